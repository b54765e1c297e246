#include "drivers/replay/replay.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "drivers/replay/record.h"

namespace emberlock {
namespace {

TimePoint first_instant(const SessionReader& session) {
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

void ReplayClock::advance_to(TimePoint t) {
  std::int64_t seen = ns_.load();
  while (seen < t.ns && !ns_.compare_exchange_weak(seen, t.ns)) {
  }
}

ReplayCamera::ReplayCamera(std::shared_ptr<SessionReader> session, std::size_t camera,
                           std::shared_ptr<ReplayClock> clock)
    : session_(std::move(session)),
      camera_(camera),
      clock_(std::move(clock)),
      // The reader has checked the layout, the one thing that can be wrong.
      info_(camera_info(session_->manifest().cameras(static_cast<int>(camera))).value()) {}

Status ReplayCamera::start() {
  filming_ = true;
  return {};
}

Result<Frame> ReplayCamera::next_frame(Seconds /*deadline*/) {
  if (!filming_)
    return Error{ErrorKind::device, "the camera isn't filming", "camera " + info_.id, "Start it first"};
  const std::size_t i = next_frame_;
  if (i < session_->stamps(camera_).size()) {
    ++next_frame_;
    clock_->advance_to(session_->stamps(camera_)[i].monotonic_time);
  }
  return session_->read(camera_, i);
}

Status ReplayCamera::reset_shutter(TimePoint /*at*/) {
  const auto& events = session_->events();
  const auto mine = [&](const v1::Event& e) { return e.has_reset() && e.reset().camera_id() == info_.id; };
  const auto found =
      std::find_if(events.begin() + static_cast<std::ptrdiff_t>(next_event_), events.end(), mine);
  if (found == events.end()) return off_course("the recording shows no further reset", "camera " + info_.id);
  next_event_ = static_cast<std::size_t>(found - events.begin()) + 1;
  clock_->advance_to({found->monotonic_ns()});
  return {};
}

ReplayStrobe::ReplayStrobe(std::shared_ptr<const SessionReader> session, std::shared_ptr<ReplayClock> clock)
    : session_(std::move(session)), clock_(std::move(clock)) {}

Status ReplayStrobe::apply(const StrobeSettings& settings) {
  const auto& events = session_->events();
  const auto found = std::find_if(events.begin() + static_cast<std::ptrdiff_t>(next_event_), events.end(),
                                  [](const v1::Event& e) { return e.has_strobe(); });
  if (found == events.end())
    return off_course("the recording shows no further setting of the strobe", "strobe");
  EMBERLOCK_ASSIGN_OR_RETURN(StrobeSettings recorded, strobe_settings(found->strobe()));
  if (recorded.output != settings.output) {
    return off_course("the recorded strobe was switched to another output here", "strobe");
  }
  state_ = std::move(recorded);
  applied_ = true;
  next_event_ = static_cast<std::size_t>(found - events.begin()) + 1;
  clock_->advance_to({found->monotonic_ns()});
  return {};
}

Result<StrobeSettings> ReplayStrobe::read_back() {
  if (!applied_) return off_course("the strobe's state before its first setting wasn't recorded", "strobe");
  return state_;
}

Result<ReplayRig> ReplayRig::open(const std::filesystem::path& folder) {
  EMBERLOCK_ASSIGN_OR_RETURN(SessionReader reader, SessionReader::open(folder));
  ReplayRig rig;
  rig.session = std::make_shared<SessionReader>(std::move(reader));
  rig.clock = std::make_shared<ReplayClock>(first_instant(*rig.session));
  for (std::size_t i = 0; i < rig.session->camera_count(); ++i) {
    rig.cameras.push_back(std::make_unique<ReplayCamera>(rig.session, i, rig.clock));
  }
  rig.strobe = std::make_unique<ReplayStrobe>(rig.session, rig.clock);
  return rig;
}

}  // namespace emberlock
