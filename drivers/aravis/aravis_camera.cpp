// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/aravis_camera.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "base/log.h"
#include "drivers/aravis/gvcp.h"

namespace emberlock::drivers::aravis {
namespace {

/// The part of kCallDeadline that a library call may take; the rest is for our own code.
constexpr Seconds kLibraryDeadline = kCallDeadline - milliseconds(100);
constexpr TimePoint kEver{std::numeric_limits<std::int64_t>::max()};
constexpr Seconds kSlice = milliseconds(100);  // between two searches for a lost camera
/// After this silence a GigE camera is asked repeatedly for a register, and given up when it doesn't answer
/// for kUnanswered. This is sooner than the heartbeat fails, which takes the library 5 .. 6.1 s.
constexpr Seconds kSilent{1}, kAskEvery{0.5}, kUnanswered{2};

CameraInfo info_of(const std::string& id, const Link& link) {
  CameraInfo info;
  info.id = id;
  info.model = link.discovered().model;
  info.layout = link.applied().offer.mode.layout;
  info.frame_rate = link.applied().frame_rate;
  info.reset = ShutterReset::on_command;
  return info;
}

}  // namespace

AravisCamera::AravisCamera(std::string id, CameraRequest request, std::shared_ptr<Link> link)
    : id_(std::move(id)), request_(std::move(request)), info_(info_of(id_, *link)), link_(std::move(link)) {}

AravisCamera::~AravisCamera() {
  if (link_ != nullptr) let_go(kLibraryDeadline);
}

Error AravisCamera::failure(std::string what, std::string remedy) const {
  return {ErrorKind::device, std::move(what), "camera " + id_, std::move(remedy)};
}

template <class T>
std::optional<T> AravisCamera::bounded(Seconds deadline, std::function<T(Link&)> call) {
  const auto returned = std::make_shared<std::atomic<bool>>(false);
  auto answer = in_background<T>([call = std::move(call), returned, link = link_]() mutable {
    T value = call(*link);
    link.reset();
    *returned = true;
    return value;
  });
  if (done_within(answer, deadline)) return answer.get();
  log(LogCategory::drivers).warn("camera {}: it hangs, and is left alone until its last call returns", id_);
  filming_ = false;
  held_.reset();
  link_.reset();
  hanging_ = returned;
  hangs_since_ = clock_.now();
  return {};
}

void AravisCamera::let_go(Seconds deadline) {
  held_.reset();
  const auto closed = in_background<bool>([link = std::exchange(link_, nullptr)]() mutable {
    link.reset();
    return true;
  });
  done_within(closed, deadline);
}

Error AravisCamera::lose(std::string what) {
  filming_ = false;
  ledger_.begin_anew();
  link_->give_up();
  let_go(Seconds(0));
  Error error = failure(std::move(what), "check its cable and power; start() looks for it again");
  log(LogCategory::drivers).warn("{}", error.message());
  return error;
}

Status AravisCamera::start() {
  if (filming_) return {};
  if (hanging_ && !*hanging_) {
    return failure(fmt::format("it hangs: it was asked {:.0f} s ago and hasn't answered",
                               (clock_.now() - hangs_since_).value()),
                   "it is left alone until that call returns; cut its power if it doesn't");
  }
  hanging_.reset();
  if (link_ != nullptr && link_->control_lost()) let_go(Seconds(0));
  if (!starting_) {
    starting_ =
        in_background<Linked>([id = id_, request = request_, link = std::exchange(link_, nullptr)]() mutable {
          if (link == nullptr) {
            const auto seen = locate(id);
            if (!seen) return Linked(seen.error());
            auto opened = Link::open(*seen, request);
            if (!opened) return opened;
            link = std::move(opened).value();
          }
          const Status started = link->start();
          return started ? Linked(std::move(link)) : Linked(started.error());
        });
    hangs_since_ = clock_.now();
  }
  if (!done_within(*starting_, kLibraryDeadline)) {
    return failure(fmt::format("it hasn't answered for {:.0f} s", (clock_.now() - hangs_since_).value()),
                   "start() goes on waiting for it");
  }
  auto linked = std::exchange(starting_, std::nullopt)->get();
  if (!linked) return linked.error();
  link_ = std::move(linked).value();
  if (link_->applied().offer.mode.layout != info_.layout) {
    let_go(Seconds(0));
    return failure("its pictures have another size or format than before", "open it anew");
  }
  filming_ = true;
  ledger_.begin_anew();
  wanted_from_ = {};
  device_time_ = {};
  last_sign_ = clock_.now();
  unanswered_since_.reset();
  signs_ = 0;
  last_came_ = {};
  droughts_ended_.clear();
  return {};
}

void AravisCamera::stop() {
  if (!filming_) return;
  filming_ = false;
  const TimePoint until = clock_.now() + kLibraryDeadline;
  pass_over_before(kEver);  // counted before the call that may hang
  const auto stopped =
      bounded<bool>(kLibraryDeadline, [](Link& link) { return link.stop_acquisition().ok(); });
  if (!stopped) return;
  if (!*stopped) return let_go(Seconds(0));  // the camera is gone; start() searches for it
  // The library gives up an incomplete last frame 0.1 s after its last packet.
  while (clock_.now() < until) {
    auto arrived = next_arrived(milliseconds(150));
    if (!arrived) break;
    drop(*std::move(arrived), FrameOutcome::passed_over);
  }
  ledger_.begin_anew();
  bounded<bool>(until - clock_.now(), [](Link& link) { return link.close_stream(), true; });
}

std::optional<Arrived> AravisCamera::next_arrived(Seconds deadline) {
  if (held_) return std::exchange(held_, std::nullopt);
  return link_->pop(deadline);
}

std::uint64_t AravisCamera::record(std::optional<std::uint64_t> frame_id, TimePoint came,
                                   FrameOutcome outcome) {
  if (!frame_id) {
    ledger_.unnumbered(outcome);
    return {};
  }
  // Missing frames are underruns if the stream got a free buffer again between the two frames that arrived.
  bool starved = false;
  for (; !droughts_ended_.empty() && droughts_ended_.front() <= came; droughts_ended_.pop_front()) {
    starved = starved || droughts_ended_.front() > last_came_;
  }
  last_came_ = came;
  return ledger_.record(*frame_id, outcome, starved ? FrameOutcome::underrun : FrameOutcome::camera_gap);
}

void AravisCamera::note_drought() {
  if (link_->starving()) droughts_ended_.push_back(clock_.now());
}

void AravisCamera::drop(Arrived arrived, FrameOutcome outcome) {
  if (arrived.arrival == Arrival::transport) outcome = FrameOutcome::transport;
  if (arrived.arrival == Arrival::resend) outcome = FrameOutcome::resend;
  record(arrived.frame_id, arrived.came, outcome);
  note_drought();
  link_->recycle(std::move(arrived));
}

std::optional<Frame> AravisCamera::hand_on(Arrived arrived) {
  if (arrived.arrival == Arrival::transport || arrived.arrival == Arrival::resend ||
      arrived.arrival == Arrival::cleared || arrived.came < wanted_from_ || !arrived.frame_id) {
    drop(std::move(arrived), FrameOutcome::passed_over);
    return {};
  }
  // A clock that goes backward shows that parts of two frames were mixed. Cameras without a clock report 0.
  const bool damaged = arrived.arrival == Arrival::odd || arrived.device_time < device_time_;
  Frame frame;
  frame.stamp.device_time = device_time_ = arrived.device_time;
  frame.stamp.system_time = arrived.system_time;
  frame.stamp.monotonic_time = arrived.came;
  frame.stamp.status = damaged ? FrameStatus::damaged : FrameStatus::complete;
  const auto frame_id = arrived.frame_id;
  note_drought();
  auto image = link_->take(std::move(arrived));
  if (!image) {
    record(frame_id, frame.stamp.monotonic_time, FrameOutcome::transport);
    log(LogCategory::drivers).warn("camera {}: {}", id_, image.error().message());
    return {};
  }
  frame.stamp.frame_id =
      record(frame_id, frame.stamp.monotonic_time, damaged ? FrameOutcome::damaged : FrameOutcome::delivered);
  frame.image = std::move(image).value();
  return frame;
}

bool AravisCamera::silent() {
  if (link_->discovered().transport != Transport::gige) return false;  // USB reports it at once
  const std::uint64_t signs = link_->signs_of_life();
  const TimePoint now = clock_.now();
  if (std::exchange(signs_, signs) != signs) {
    last_sign_ = now;
    unanswered_since_.reset();
  }
  if (now - last_sign_ < kSilent || now < next_question_) return false;
  next_question_ = now + kAskEvery;
  if (answers(link_->discovered().address)) {
    last_sign_ = clock_.now();
    unanswered_since_.reset();
    return false;
  }
  if (!unanswered_since_) unanswered_since_ = now;
  return now - *unanswered_since_ >= kUnanswered;
}

Result<Frame> AravisCamera::next_frame(Seconds deadline) {
  if (!filming_) return failure("it does not film", "start() it first");
  const TimePoint until = clock_.now() + std::max(Seconds(0), deadline);
  for (;;) {
    const Seconds left = until - clock_.now();
    if (auto arrived = next_arrived(std::clamp(left, Seconds(0), kSlice))) {
      if (auto frame = hand_on(*std::move(arrived))) return *std::move(frame);
      continue;
    }
    if (link_->control_lost()) return lose("it went away, or another program took control of it");
    if (silent()) return lose("it went away: it neither sends nor answers");
    if (left <= Seconds(0)) {
      return Error{ErrorKind::timed_out, "no frame came in time", "camera " + id_,
                   "wait longer, or check its trigger"};
    }
  }
}

std::uint64_t AravisCamera::pass_over(TimePoint until) {
  if (!filming_) return 0;
  return pass_over_before(until + nanoseconds(1));
}

std::uint64_t AravisCamera::pass_over_before(TimePoint instant) {
  const std::uint64_t before = ledger_.counts().passed_over;
  while (auto arrived = next_arrived(Seconds(0))) {
    if (arrived->came >= instant) {
      held_ = std::move(arrived);
      break;
    }
    drop(*std::move(arrived), FrameOutcome::passed_over);
  }
  return ledger_.counts().passed_over - before;
}

Status AravisCamera::reset_shutter(TimePoint at) {
  if (!filming_) return failure("it does not film", "start() it first");
  const TimePoint ordered = clock_.now();
  if (at - ordered > kLongestReset) {
    return failure(fmt::format("a reset {:.1f} s ahead is too early to order", (at - ordered).value()),
                   fmt::format("order it at most {:.1f} s before", kLongestReset.value()));
  }
  clock_.sleep_until(at);
  pass_over_before(kEver);
  const auto restarted = bounded<Result<TimePoint>>(ordered + kLibraryDeadline - clock_.now(),
                                                    [](Link& link) { return link.restart_acquisition(); });
  if (!restarted) return failure("it hangs, and didn't restart its cycle when told to", "cut its power");
  if (!*restarted) return lose(restarted->error().what);
  wanted_from_ = restarted->value();
  pass_over_before(wanted_from_);
  ledger_.begin_anew();
  device_time_ = {};
  last_sign_ = clock_.now();
  return {};
}

Status AravisCamera::trim_rate(PartsPerMillion /*trim*/) {
  return failure("its frame rate can't be trimmed", "choose a camera whose rate can be");
}

}  // namespace emberlock::drivers::aravis
