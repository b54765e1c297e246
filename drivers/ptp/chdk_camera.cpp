// SPDX-License-Identifier: Apache-2.0
#include "drivers/ptp/chdk_camera.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/clock.h"
#include "base/log.h"

namespace emberlock::drivers {
namespace {

constexpr Seconds kPollPause = milliseconds(15);
/// A request that isn't answered for this long is abandoned.
constexpr Seconds kAnswerDeadline{1};
constexpr int kMostLostInARow = 3;
constexpr Seconds kEndOfQuestion = milliseconds(300);

std::string_view name(ChdkReset reset) {
  switch (reset) {
    case ChdkReset::mode_toggle:
      return "mode";
    case ChdkReset::movie:
      return "movie";
    case ChdkReset::power_cycle:
      return "power";
  }
  return "";
}

}  // namespace

Result<ChdkCameraOptions> chdk_camera_options(const CameraRequest& request, const std::string& camera) {
  const auto bad = [&](std::string what, std::string remedy) {
    return Error{ErrorKind::bad_input, std::move(what), "camera " + camera, std::move(remedy)};
  };
  ChdkCameraOptions options;
  for (const auto& [key, value] : request.controls) {
    if (key == "power_command") {
      options.power_command = value;
    } else if (key == "reset") {
      constexpr ChdkReset kAll[] = {ChdkReset::mode_toggle, ChdkReset::movie, ChdkReset::power_cycle};
      const auto* found =
          std::find_if(std::begin(kAll), std::end(kAll), [&v = value](ChdkReset r) { return name(r) == v; });
      if (found == std::end(kAll)) {
        return bad("control reset=" + value + " isn't known", "use mode, movie or power");
      }
      options.reset = *found;
    } else {
      return bad("it has no control " + key, "its controls are reset and power_command");
    }
  }
  if (options.reset == ChdkReset::power_cycle && options.power_command.empty()) {
    return bad("reset=power needs a command",
               "give power_command, a command line that switches it off and on");
  }
  if (request.exposure) return bad("its exposure can't be set from here", "set it on the camera");
  return options;
}

std::vector<CameraMode> chdk_modes(ImageSize size) {
  return {{{size, PixelFormat::rgb8, 8}, "CHDK live view", kLiveViewRate},
          {{size, PixelFormat::gray8, 8}, "CHDK live view, brightness", kLiveViewRate}};
}

Result<std::unique_ptr<ChdkCamera>> ChdkCamera::open(PtpConnect connect, const CameraRequest& request,
                                                     std::shared_ptr<Clock> clock) {
  std::unique_ptr<ChdkCamera> camera(new ChdkCamera(std::move(connect), std::move(clock)));
  EMBERLOCK_RETURN_IF_ERROR(camera->connect());
  EMBERLOCK_ASSIGN_OR_RETURN(camera->options_, chdk_camera_options(request, camera->info_.id));
  Clock& time = *camera->clock_;
  camera->steps_ = {Step::record};
  const TimePoint until = time.now() + kChangeDeadline;
  while (time.now() < until) {
    EMBERLOCK_RETURN_IF_ERROR(camera->advance());
    if (camera->steps_.empty()) {
      EMBERLOCK_RETURN_IF_ERROR(camera->chdk().ask_for_live_view());
      EMBERLOCK_ASSIGN_OR_RETURN(const PtpAnswer answer, camera->session_->finish(kAnswerDeadline));
      EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<LiveView> view, parse_live_view(answer.data));
      if (view) {
        EMBERLOCK_ASSIGN_OR_RETURN(const CameraMode mode, choose_mode(chdk_modes(view->size), request,
                                                                      "camera " + camera->info_.id));
        camera->info_.layout = mode.layout;
        camera->info_.frame_rate = std::min(mode.frame_rate, request.frame_rate.value_or(mode.frame_rate));
        return camera;
      }
    }
    time.sleep_until(time.now() + kPollPause);
  }
  return camera->refuse("it shows no live view in record mode", "see what its screen says");
}

Error ChdkCamera::refuse(std::string what, std::string remedy) const {
  return {ErrorKind::device, std::move(what), "camera " + info_.id, std::move(remedy)};
}

Error ChdkCamera::late(Seconds deadline) const {
  return {ErrorKind::timed_out, fmt::format("no frame within {:.3f} s", deadline.value()),
          "camera " + info_.id, "wait longer than a frame period, and after a reset longer than its latency"};
}

Status ChdkCamera::connect() {
  EMBERLOCK_ASSIGN_OR_RETURN(PtpConnection connection, connect_());
  info_.id = connection.id;
  info_.model = connection.info.model;
  info_.reset = ShutterReset::on_command;
  if (!may_run_chdk(connection)) {
    return refuse("it doesn't run CHDK", "put CHDK on its card and start it from there (chdk.fandom.com)");
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const ChdkVersion version, Chdk(*connection.session).version());
  log(LogCategory::drivers).debug("{}: CHDK {}.{}", info_.id, version.major, version.minor);
  session_ = std::move(connection.session);
  return {};
}

Status ChdkCamera::begin(Step step) {
  switch (step) {
    case Step::play:
      return chdk().change_mode(ChdkMode::play);
    case Step::record: {
      EMBERLOCK_ASSIGN_OR_RETURN(const ChdkMode mode, chdk().mode());
      return mode == ChdkMode::record ? Status() : chdk().change_mode(ChdkMode::record);
    }
    case Step::movie_on:
    case Step::movie_off:
      return chdk().press_movie_button();
    case Step::power: {
      EMBERLOCK_ASSIGN_OR_RETURN(power_, PowerCommand::start(options_.power_command, info_.id));
      return {};
    }
  }
  return {};
}

Result<bool> ChdkCamera::ended(Step step) {
  if (step == Step::power) return power_cycled();
  if (step == Step::play || step == Step::record) {
    EMBERLOCK_ASSIGN_OR_RETURN(const ChdkMode mode, chdk().mode());
    return mode == (step == Step::play ? ChdkMode::play : ChdkMode::record);
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const ChdkMovie movie, chdk().movie());
  return movie == (step == Step::movie_on ? ChdkMovie::recording : ChdkMovie::stopped);
}

Result<bool> ChdkCamera::power_cycled() {
  switch (power_->state()) {
    case PowerCommand::State::running:
      return false;
    case PowerCommand::State::failed:
      return refuse("its power command failed", "try \"" + options_.power_command + "\" by hand");
    case PowerCommand::State::succeeded:
      break;
  }
  // The camera was switched on again only if the old connection is dead and a new one succeeds.
  if (session_) {
    if (!chdk().version().ok()) session_.reset();
    return false;
  }
  return connect().ok();
}

Status ChdkCamera::advance() {
  while (!steps_.empty()) {
    const Step step = steps_.front();
    if (!step_since_) {
      step_since_ = clock_->now();
      EMBERLOCK_RETURN_IF_ERROR(begin(step));
    }
    EMBERLOCK_ASSIGN_OR_RETURN(const bool end, ended(step));
    const Seconds took = clock_->now() - *step_since_;
    if (!end) {
      if (took <= (step == Step::power ? kPowerDeadline : kChangeDeadline)) return {};
      static constexpr std::string_view kWhat[] = {"enter playback mode", "enter record mode",
                                                   "start a movie", "end its movie",
                                                   "come back after its power was cycled"};
      return refuse(fmt::format("it didn't {} within {:.1f} s", kWhat[static_cast<int>(step)], took.value()),
                    "see what its screen says");
    }
    steps_.pop_front();
    step_since_.reset();
    power_.reset();
  }
  return {};
}

Status ChdkCamera::start() {
  if (filming_) return {};
  if (!session_) EMBERLOCK_RETURN_IF_ERROR(connect());
  steps_ = {Step::record};
  step_since_.reset();
  const Status begun = advance();
  if (!begun.ok()) return lose(begun.error());
  filming_ = true;
  lost_in_a_row_ = 0;
  next_question_ = last_picture_ = clock_->now();
  return {};
}

void ChdkCamera::stop() {
  if (!filming_) return;
  if (session_) drop_question();
  filming_ = false;
  steps_.clear();
  step_since_.reset();
  power_.reset();
}

void ChdkCamera::drop_question() {
  if (!session_->pending_since()) return;
  if (!session_->finish(kEndOfQuestion).ok()) session_->give_up();
  ++counts_.passed_over;
  ++next_id_;
}

Status ChdkCamera::reset_shutter(TimePoint at) {
  if (!filming_) return refuse("it does not film", "start() it before resetting its shutter");
  clock_->sleep_until(at);
  const Status begun = begin_reset();
  return begun.ok() ? begun : lose(begun.error());
}

Status ChdkCamera::begin_reset() {
  drop_question();
  last_reset_ = Reset{clock_->now()};
  step_since_.reset();
  switch (options_.reset) {
    case ChdkReset::mode_toggle:
      steps_ = {Step::play, Step::record};
      break;
    case ChdkReset::movie: {
      EMBERLOCK_ASSIGN_OR_RETURN(const ChdkMovie movie, chdk().movie());
      steps_ = movie == ChdkMovie::recording ? std::deque{Step::movie_off, Step::movie_on}
                                             : std::deque{Step::movie_on, Step::movie_off};
      break;
    }
    case ChdkReset::power_cycle:
      steps_ = {Step::power, Step::record};
      break;
  }
  return advance();
}

Status ChdkCamera::trim_rate(PartsPerMillion /*trim*/) {
  return refuse("its frame rate can't be trimmed", "choose a camera whose rate can be");
}

Error ChdkCamera::lose(Error error) {
  session_.reset();
  filming_ = false;
  steps_.clear();
  step_since_.reset();
  power_.reset();
  error.kind = ErrorKind::device;
  if (error.where.empty()) error.where = "camera " + info_.id;
  return error;
}

Result<Frame> ChdkCamera::next_frame(Seconds deadline) {
  if (!filming_) return refuse("it does not film", "start() it first");
  const TimePoint until = clock_->now() + deadline;
  for (;;) {
    if (steps_.empty()) {
      auto frame = fetch(until);
      if (!frame.ok()) return lose(frame.error());
      if (*frame) return std::move(**frame);
    } else {
      const Status gone_on = advance();
      if (!gone_on.ok()) return lose(gone_on.error());
      if (steps_.empty()) {
        next_question_ = last_picture_ = clock_->now();
        continue;
      }
      clock_->sleep_until(std::min(until, clock_->now() + kPollPause));
    }
    if (clock_->now() >= until) return late(deadline);
  }
}

Result<std::optional<Frame>> ChdkCamera::fetch(TimePoint until) {
  if (!session_->pending_since()) {
    clock_->sleep_until(std::min(until, next_question_));
    if (clock_->now() < next_question_) return std::optional<Frame>();
    EMBERLOCK_RETURN_IF_ERROR(chdk().ask_for_live_view());
    // A late camera isn't asked for the frames that it missed.
    next_question_ = std::max(next_question_ + period(info_.frame_rate), clock_->now());
  }
  const TimePoint asked = *session_->pending_since();
  auto answer = session_->finish(std::max(Seconds(0), until - clock_->now()));
  if (!answer.ok() && session_->pending_since()) {
    if (clock_->now() - asked < kAnswerDeadline) return std::optional<Frame>();
    session_->give_up();
    return lost_answer(refuse("it answers no more", "switch it off and on again"));
  }
  if (!answer.ok()) return lost_answer(answer.error());
  const auto view = picture_of(*answer);
  if (!view.ok()) return lost_answer(view.error());
  if (*view) return std::optional(frame_of(**view));
  if (clock_->now() - last_picture_ > kChangeDeadline) {
    return refuse("it shows no live view any more, or one of another size", "see what its screen says");
  }
  return std::optional<Frame>();
}

Result<std::optional<Frame>> ChdkCamera::lost_answer(Error error) {
  ++counts_.transport;
  ++next_id_;
  if (++lost_in_a_row_ >= kMostLostInARow) return error;
  log(LogCategory::drivers).warn("{}: a frame was lost: {}", info_.id, error.message());
  return std::optional<Frame>();
}

Result<std::optional<LiveView>> ChdkCamera::picture_of(const PtpAnswer& answer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<LiveView> view, parse_live_view(answer.data));
  if (!view || view->size == info_.layout.size) return view;
  ++counts_.camera_gap;
  ++next_id_;
  return std::optional<LiveView>();
}

Frame ChdkCamera::frame_of(const LiveView& view) {
  lost_in_a_row_ = 0;
  last_picture_ = clock_->now();
  if (last_reset_ && !last_reset_->first_frame) last_reset_->first_frame = last_picture_;
  FrameStamp stamp;
  stamp.frame_id = next_id_++;
  stamp.device_time = last_picture_;
  stamp.monotonic_time = last_picture_;
  stamp.system_time = wall_clock();
  ++counts_.delivered;
  return {stamp, std::make_shared<const Image>(image_of(view, info_.layout.format))};
}

}  // namespace emberlock::drivers
