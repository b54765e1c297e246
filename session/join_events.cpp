// SPDX-License-Identifier: Apache-2.0
#include "session/join_events.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

namespace emberlock::session {
namespace {

void put_on_session(const HostClock& clock, v1::Event& event) {
  event.set_monotonic_ns(clock.on_session({event.monotonic_ns()}).ns);
  if (event.has_reset()) event.mutable_reset()->set_at_ns(clock.on_session({event.reset().at_ns()}).ns);
}

/// By its place in the part's manifest each camera has an entry, which a row of numbers tells in no other
/// place.
bool goes_by_places(const v1::Event& event) { return event.has_decision() || event.has_settings(); }

/// Of one lock: of the same round, with the same verdict.
const v1::DecisionEvent* same_lock(const v1::DecisionEvent& lock, const PartEvents& part) {
  const auto found = std::find_if(part.events.begin(), part.events.end(), [&](const v1::Event& event) {
    return event.has_decision() && event.decision().cameras_size() == part.cameras &&
           event.decision().round() == lock.round() && event.decision().verdict() == lock.verdict();
  });
  return found == part.events.end() ? nullptr : &found->decision();
}

/// Errors are from one target, so that the worst pair is the earliest and the latest.
void tell_worst_pair(v1::DecisionEvent& lock) {
  lock.clear_worst_pair_s();
  const auto& cameras = lock.cameras();
  if (cameras.empty() ||
      std::any_of(cameras.begin(), cameras.end(), [](const auto& camera) { return !camera.has_error_s(); }))
    return;
  const auto [least, most] = std::minmax_element(
      cameras.begin(), cameras.end(), [](const auto& a, const auto& b) { return a.error_s() < b.error_s(); });
  lock.set_worst_pair_s(most->error_s() - least->error_s());
}

/// Takes up what every other part tells of the lock; nothing where one doesn't. How many it took.
std::uint64_t take_up_others(const std::vector<PartEvents>& parts, v1::DecisionEvent& lock) {
  if (parts.size() < 2 || lock.cameras_size() != parts.front().cameras) return 0;
  std::vector<const v1::DecisionEvent*> others;
  for (std::size_t i = 1; i < parts.size(); ++i) {
    others.push_back(same_lock(lock, parts[i]));
    if (others.back() == nullptr) return 0;
  }
  for (const v1::DecisionEvent* other : others) lock.mutable_cameras()->MergeFrom(other->cameras());
  tell_worst_pair(lock);
  return others.size();
}

}  // namespace

JoinedEvents join_events(std::vector<PartEvents> parts) {
  JoinedEvents joined;
  if (parts.empty()) return joined;
  std::uint64_t taken_up = 0;
  for (v1::Event& event : parts.front().events)
    if (event.has_decision()) taken_up += take_up_others(parts, *event.mutable_decision());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    std::vector<v1::Event> events = std::move(parts[i].events);
    if (i > 0) joined.left_out += std::erase_if(events, goes_by_places);
    for (v1::Event& event : events) put_on_session(parts[i].clock, event);
    std::vector<v1::Event> all;
    std::merge(std::make_move_iterator(joined.events.begin()), std::make_move_iterator(joined.events.end()),
               std::make_move_iterator(events.begin()), std::make_move_iterator(events.end()),
               std::back_inserter(all),
               [](const v1::Event& a, const v1::Event& b) { return a.monotonic_ns() < b.monotonic_ns(); });
    joined.events = std::move(all);
  }
  joined.left_out -= std::min(joined.left_out, taken_up);
  return joined;
}

}  // namespace emberlock::session
