// SPDX-License-Identifier: Apache-2.0
#include "drivers/replay/replay.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "drivers/replay/record.h"

namespace emberlock::drivers {
namespace {

TimePoint first_instant(const session::SessionReader& session) {
  TimePoint first{std::numeric_limits<std::int64_t>::max()};
  for (std::size_t c = 0; c < session.camera_count(); ++c) {
    if (!session.stamps(c).empty()) first = std::min(first, session.stamps(c).front().monotonic_time);
  }
  if (!session.events().empty()) first = std::min(first, TimePoint{session.events().front().monotonic_ns()});
  return first.ns == std::numeric_limits<std::int64_t>::max() ? TimePoint{} : first;
}

Error off_course(std::string what, std::string where) {
  return {ErrorKind::device, std::move(what), std::move(where),
          "Replay with the version and the options that recorded the session"};
}

}  // namespace

ReplayClock::ReplayClock(const session::SessionReader& session) : latest_(first_instant(session)) {
  for (const v1::Event& event : session.events()) {
    instants_.push_back({event.monotonic_ns()});
    done_.push_back(!event.has_strobe() && !event.has_reset() && !event.has_trim());
  }
  next_ = static_cast<std::size_t>(std::find(done_.begin(), done_.end(), false) - done_.begin());
}

TimePoint ReplayClock::now() const {
  const std::scoped_lock lock(mutex_);
  if (own_) return *own_;
  return next_ < instants_.size() ? instants_[next_] : latest_;
}

void ReplayClock::sleep_until(TimePoint t) {
  const std::scoped_lock lock(mutex_);
  latest_ = std::max(latest_, t);
}

void ReplayClock::frame_replayed(TimePoint arrival) {
  const std::scoped_lock lock(mutex_);
  latest_ = std::max(latest_, arrival);
  own_.reset();
}

void ReplayClock::event_replayed(std::size_t event, After after) {
  const std::scoped_lock lock(mutex_);
  latest_ = std::max(latest_, instants_[event]);
  own_.reset();
  if (after == After::own_instant) own_ = instants_[event];
  done_[event] = true;
  while (next_ < done_.size() && done_[next_]) ++next_;
}

ReplayCamera::ReplayCamera(std::shared_ptr<session::SessionReader> session, std::size_t camera,
                           std::shared_ptr<ReplayClock> clock)
    : session_(std::move(session)),
      camera_(camera),
      clock_(std::move(clock)),
      // Safe: the only possible error is the layout, which the reader has checked.
      info_(camera_info(session_->manifest().cameras(static_cast<int>(camera))).value()) {
  for (const v1::Event& event : session_->events()) {
    if (auto late = late_frame(event); late && late->camera_id == info_.id) late_.push_back(*late);
  }
}

Status ReplayCamera::start() {
  filming_ = true;
  return {};
}

bool ReplayCamera::late(Seconds deadline) {
  constexpr Seconds kRounding{1e-6};
  if (late_.empty() || late_.front().after_frames != next_frame_) return false;
  waited_ += deadline;
  if (waited_ + kRounding >= late_.front().waited) {
    waited_ = Seconds(0);
    late_.pop_front();
  }
  return true;
}

Result<Frame> ReplayCamera::next_frame(Seconds deadline) {
  if (!filming_)
    return Error{ErrorKind::device, "the camera isn't filming", "camera " + info_.id, "Start it first"};
  if (late(deadline)) return Error{ErrorKind::timed_out, "no frame came in time", "camera " + info_.id};
  const std::size_t i = next_frame_;
  if (i < session_->stamps(camera_).size()) {
    ++next_frame_;
    const FrameStamp& stamp = session_->stamps(camera_)[i];
    ++(stamp.status == FrameStatus::complete ? counts_.delivered : counts_.damaged);
    clock_->frame_replayed(stamp.monotonic_time);
  }
  return session_->read(camera_, i);
}

std::optional<std::size_t> ReplayCamera::next_order() const {
  const auto& events = session_->events();
  for (std::size_t i = next_event_; i < events.size(); ++i) {
    const v1::Event& e = events[i];
    if (e.has_reset() && e.reset().camera_id() == info_.id) return i;
    if (e.has_trim() && e.trim().camera_id() == info_.id) return i;
  }
  return std::nullopt;
}

Status ReplayCamera::reset_shutter(TimePoint at) {
  const auto index = next_order();
  if (!index || !session_->events()[*index].has_reset())
    return off_course("the recording shows no further reset", "camera " + info_.id);
  const std::int64_t recorded = session_->events()[*index].reset().at_ns();
  if (recorded != at.ns) {
    return off_course("the recorded reset was ordered for " + std::to_string(recorded) + " ns, not for " +
                          std::to_string(at.ns) + " ns",
                      "camera " + info_.id);
  }
  next_event_ = *index + 1;
  clock_->event_replayed(*index, ReplayClock::After::next_event);
  return {};
}

Status ReplayCamera::trim_rate(PartsPerMillion trim) {
  const auto index = next_order();
  if (!index || !session_->events()[*index].has_trim())
    return off_course("the recording shows no further trim", "camera " + info_.id);
  const double recorded = session_->events()[*index].trim().trim_ppm();
  if (recorded != trim.value()) {
    return off_course("the recorded trim was " + std::to_string(recorded) + " ppm, not " +
                          std::to_string(trim.value()) + " ppm",
                      "camera " + info_.id);
  }
  next_event_ = *index + 1;
  clock_->event_replayed(*index, ReplayClock::After::next_event);
  return {};
}

ReplayStrobe::ReplayStrobe(std::shared_ptr<const session::SessionReader> session,
                           std::shared_ptr<ReplayClock> clock)
    : session_(std::move(session)), clock_(std::move(clock)) {}

Result<std::size_t> ReplayStrobe::next_state() const {
  const auto& events = session_->events();
  const auto found = std::find_if(events.begin() + static_cast<std::ptrdiff_t>(next_event_), events.end(),
                                  [](const v1::Event& e) { return e.has_strobe(); });
  if (found == events.end())
    return off_course("the recording shows no further state of the strobe", "strobe");
  return static_cast<std::size_t>(found - events.begin());
}

Status ReplayStrobe::apply(const StrobeSettings& settings) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t index, next_state());
  EMBERLOCK_ASSIGN_OR_RETURN(const StrobeSettings recorded,
                             strobe_settings(session_->events()[index].strobe()));
  if (recorded.output == settings.output) return {};
  return off_course("the recorded strobe was switched to another output here", "strobe");
}

Result<StrobeSettings> ReplayStrobe::read_back() {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t index, next_state());
  EMBERLOCK_ASSIGN_OR_RETURN(StrobeSettings recorded, strobe_settings(session_->events()[index].strobe()));
  next_event_ = index + 1;
  clock_->event_replayed(index, ReplayClock::After::own_instant);
  return recorded;
}

Result<ReplayRig> ReplayRig::open(const std::filesystem::path& folder) {
  EMBERLOCK_ASSIGN_OR_RETURN(session::SessionReader reader, session::SessionReader::open(folder));
  ReplayRig rig;
  rig.session = std::make_shared<session::SessionReader>(std::move(reader));
  rig.clock = std::make_shared<ReplayClock>(*rig.session);
  for (std::size_t i = 0; i < rig.session->camera_count(); ++i) {
    rig.cameras.push_back(std::make_unique<ReplayCamera>(rig.session, i, rig.clock));
  }
  rig.strobe = std::make_unique<ReplayStrobe>(rig.session, rig.clock);
  return rig;
}

}  // namespace emberlock::drivers
