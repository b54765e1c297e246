// SPDX-License-Identifier: Apache-2.0
#include "daemon/ar/live_ar.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "base/clock.h"
#include "daemon/ar/results.h"
#include "daemon/reconstruction/process.h"
#include "daemon/server/pictures.h"
#include "recon/calibrate/markers.h"

namespace emberlock::daemon {
namespace {

constexpr double kEarlyShare = 0.2;  // periods by which a frame may be early, because cameras jitter
constexpr Seconds kLately{2};

Error bad_field(const char* field, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), field, std::move(remedy)};
}

Error unexpected_answer() {
  return {ErrorKind::device, "answered with something else than was asked for",
          "the program that draws the flame", "Install emberlock and emberlockd of one version"};
}

/// 0 stands for a default.
Status check_number(const char* field, double value, double least, double most) {
  if (value == 0 || (std::isfinite(value) && value >= least && value <= most)) return {};
  return bad_field(field, "is out of range",
                   fmt::format("Give {:g} to {:g}, or 0 for the default", least, most));
}

/// With the defaults filled in.
Result<v1::ArRequest> checked(v1::ArRequest request) {
  constexpr std::size_t kLongestMarker = 100;
  EMBERLOCK_RETURN_IF_ERROR(check_number("focal_px", request.focal_px(), 1, 1e6));
  EMBERLOCK_RETURN_IF_ERROR(check_number("scale", request.scale(), 1e-3, 1e3));
  EMBERLOCK_RETURN_IF_ERROR(check_number("brightness", request.brightness(), 1e-3, 1e6));
  EMBERLOCK_RETURN_IF_ERROR(check_number("frames_hz", request.frames_hz(), 0.01, 1e3));
  if (request.marker().empty() || request.marker().size() > kLongestMarker)
    return bad_field("marker", "isn't told", "Give one like aruco:4X4_50:7:80mm");
  constexpr double kSequenceRate = 24;
  if (request.scale() == 0) request.set_scale(1);
  if (request.brightness() == 0) request.set_brightness(1);
  if (request.frames_hz() == 0) request.set_frames_hz(kSequenceRate);
  return request;
}

Result<v1::Calibration> lens_of(const v1::ArRequest& request, const ArCamera& camera) {
  if (request.focal_px() > 0) {
    v1::Calibration lens;
    lens.set_fx(request.focal_px());
    lens.set_fy(request.focal_px());
    lens.set_cx(camera.layout.size.width / 2.0);
    lens.set_cy(camera.layout.size.height / 2.0);
    return lens;
  }
  if (camera.calibration) return *camera.calibration;
  return Error{ErrorKind::bad_input, "its lens isn't known", camera.id,
               "Calibrate the rig ([rig] calibration), or give the focal length in pixels"};
}

}  // namespace

LiveAr::~LiveAr() {
  end();
  const std::lock_guard calls(calls_);
  if (thread_.joinable()) thread_.join();
}

void LiveAr::end() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_all();
}

v1::ListResultsResponse LiveAr::results() const {
  v1::ListResultsResponse listed = list_results(options_.results);
  for (const std::string& name : recon::marker_dictionaries()) listed.add_dictionaries(name);
  return listed;
}

std::optional<v1::ArStatus> LiveAr::status() const {
  const std::lock_guard lock(mutex_);
  std::optional<v1::ArStatus> status = status_;
  if (!status) return status;
  // What was shown long ago tells nothing of now.
  const TimePoint since = SteadyClock().now() - kLately;
  const auto recent =
      std::find_if(shown_.begin(), shown_.end(), [&](const Shown& one) { return one.at > since; });
  const auto count = static_cast<double>(shown_.end() - recent);
  if (count < 2) return status;
  Seconds delays{0};
  for (auto one = recent; one != shown_.end(); ++one) delays += one->delay;
  status->set_rate_hz((count - 1) / (shown_.back().at - recent->at).value());
  status->set_delay_s(delays.value() / count);
  return status;
}

Result<v1::ArStatus> LiveAr::start(const v1::ArRequest& asked, const ArCamera& camera) {
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::ArRequest request, checked(asked));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto folder,
                             find_result(options_.results, request.session(), request.result()));
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::Calibration lens, lens_of(request, camera));
  const std::lock_guard calls(calls_);
  if (over_) return Error{ErrorKind::refused, "it is shutting down", "emberlockd", "Start it again"};
  if (const auto shown = status(); shown && shown->state() == v1::ArStatus::SHOWN)
    return Error{ErrorKind::refused, "a flame is shown already, by camera " + shown->camera_id(), "the flame",
                 "Stop it first"};
  if (thread_.joinable()) thread_.join();
  v1::ArInput input;
  v1::ArInput::Scene& scene = *input.mutable_scene();
  scene.set_result(std::filesystem::absolute(folder).string());
  *scene.mutable_request() = request;
  *scene.mutable_lens() = lens;
  const ImageSize size = shown_size(camera.layout, options_.width);
  scene.set_width(static_cast<std::uint32_t>(camera.layout.size.width));
  scene.set_height(static_cast<std::uint32_t>(camera.layout.size.height));
  scene.set_frame_width(static_cast<std::uint32_t>(size.width));
  scene.set_frame_height(static_cast<std::uint32_t>(size.height));
  scene.set_threads(options_.threads);
  std::unique_lock lock(mutex_);
  status_.emplace();
  status_->set_state(v1::ArStatus::LOADING);
  status_->set_camera_id(camera.id);
  status_->set_session(request.session());
  status_->set_result(request.result());
  status_->set_marker(request.marker());
  status_->set_calibrated(request.focal_px() == 0);
  shown_.clear();
  newest_ = {};
  ending_ = false;
  thread_ = std::thread([this, input, camera] { run(input, camera); });
  changed_.wait(lock, [this] { return status_->state() != v1::ArStatus::LOADING; });
  if (status_->state() == v1::ArStatus::FAILED) return Error{ErrorKind::bad_input, status_->error()};
  if (over_) return Error{ErrorKind::refused, "it is shutting down", "emberlockd", "Start it again"};
  return *status_;
}

Result<v1::ArStatus> LiveAr::stop() {
  const std::lock_guard calls(calls_);
  if (const auto shown = status(); !shown || shown->state() != v1::ArStatus::SHOWN)
    return Error{ErrorKind::refused, "none is shown", "the flame", "There is nothing to stop"};
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
  return *status();
}

bool LiveAr::offer(const std::string& camera_id, const Frame& frame) {
  if (!shows_) return false;
  {
    const std::lock_guard lock(mutex_);
    if (!shows_ || status_->camera_id() != camera_id) return false;
    if (!frame.image || !board_.pictures_wanted()) return true;
    const TimePoint now = SteadyClock().now();
    if (now < due_ - kEarlyShare * period(options_.rate)) return true;
    newest_ = frame;
    arrived_ = now;
  }
  changed_.notify_all();
  return true;
}

void LiveAr::set_state(v1::ArStatus::State state, const std::string& error) {
  {
    const std::lock_guard lock(mutex_);
    status_->set_state(state);
    status_->set_error(error);
    shows_ = state == v1::ArStatus::SHOWN;
    if (!shows_) newest_ = {};
  }
  changed_.notify_all();
}

void LiveAr::run(const v1::ArInput& scene, const ArCamera& camera) {
  const auto fail = [this](const Error& error) {
    if (ends()) return set_state(v1::ArStatus::STOPPED);
    set_state(v1::ArStatus::FAILED, error.message());
  };
  auto child = ArChild::start(
      {options_.program.string(), "ar-live", "--progress-fd", std::to_string(ChildProcess::kMessagesFd)},
      options_.niceness);
  if (!child.ok()) return fail(child.error());
  const auto loaded = child->ask(scene, options_.patience, [this] { return ends(); });
  if (!loaded.ok()) return fail(loaded.error());
  if (!loaded->has_progress()) return fail(unexpected_answer());
  set_state(v1::ArStatus::SHOWN);
  const ImageSize size{static_cast<int>(scene.scene().frame_width()),
                       static_cast<int>(scene.scene().frame_height())};
  const Status drawn = draw(*child, camera, size);
  if (drawn.ok() || ends()) return set_state(v1::ArStatus::STOPPED);
  board_.notice(v1::AMBER,
                "The flame in the live pictures of " + camera.id + " ended: " + drawn.error().message());
  fail(drawn.error());
}

/// Until it shall end.
std::optional<Frame> LiveAr::next_frame() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ends() || newest_.image; });
  if (ends()) return std::nullopt;
  const Seconds apart = period(options_.rate);
  due_ = std::max(due_ + apart, arrived_ + (1 - kEarlyShare) * apart);
  taken_ = arrived_;
  return std::exchange(newest_, {});
}

Status LiveAr::draw(ArChild& child, const ArCamera& camera, ImageSize size) {
  std::int64_t before = 0;
  while (const std::optional<Frame> frame = next_frame()) {
    const std::int64_t at = frame->stamp.monotonic_time.ns;
    if (at <= before) continue;
    before = at;
    if (frame->image->layout() != camera.layout)
      return Error{ErrorKind::refused, "its pictures have changed their size or format", camera.id,
                   "Start the flame again"};
    EMBERLOCK_ASSIGN_OR_RETURN(const Image small, small_rgb8(camera.id, *frame, size));
    v1::ArInput input;
    input.mutable_frame()->set_monotonic_ns(at);
    input.mutable_frame()->set_rgb(small.bytes().data(), small.bytes().size());
    EMBERLOCK_ASSIGN_OR_RETURN(v1::ChildMessage answer,
                               child.ask(input, options_.patience, [this] { return ends(); }));
    if (!answer.has_ar_picture()) return unexpected_answer();
    show(*frame, size, std::move(*answer.mutable_ar_picture()));
  }
  return {};
}

void LiveAr::show(const Frame& frame, ImageSize size, v1::ArPicture&& drawn) {
  auto picture = std::make_shared<v1::Picture>();
  {
    const std::lock_guard lock(mutex_);
    picture->set_camera_id(status_->camera_id());
    status_->set_pose(drawn.pose());
    status_->set_without(drawn.without());
    status_->set_residual_px(drawn.residual_px());
    status_->set_seen_instead(drawn.seen_instead());
    const TimePoint now = SteadyClock().now();
    shown_.push_back({now, now - taken_});
    while (now - shown_.front().at > kLately) shown_.pop_front();
  }
  picture->set_frame_id(frame.stamp.frame_id);
  picture->set_monotonic_ns(frame.stamp.monotonic_time.ns);
  picture->set_width(static_cast<std::uint32_t>(size.width));
  picture->set_height(static_cast<std::uint32_t>(size.height));
  picture->set_jpeg(std::move(*drawn.mutable_jpeg()));
  board_.show(std::shared_ptr<const v1::Picture>(std::move(picture)));
}

}  // namespace emberlock::daemon
