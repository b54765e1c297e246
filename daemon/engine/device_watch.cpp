// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/device_watch.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace emberlock::daemon {
namespace {

using State = v1::CameraStatus;

bool gone(State::State state) { return state == State::LOST || state == State::QUARANTINED; }

MachineEvent raised(State::State state, const std::string& id) {
  if (state == State::LOST) return FaultRaised{{v1::Fault::CAMERA_LOST, id}, v1::RED, Why::camera_lost};
  return FaultRaised{{v1::Fault::CAMERA_HANGS, id}, v1::RED, Why::camera_hangs};
}

MachineEvent mended(State::State state, const std::string& id) {
  return FaultMended{{state == State::LOST ? v1::Fault::CAMERA_LOST : v1::Fault::CAMERA_HANGS, id}};
}

}  // namespace

DeviceWatch::DeviceWatch(std::vector<std::string> camera_ids)
    : ids_(std::move(camera_ids)),
      states_(ids_.size(), State::FILMING),
      refusals_(ids_.size()),
      rates_(ids_.size(), 0.0),
      came_(ids_.size(), 0) {}

std::vector<MachineEvent> DeviceWatch::cameras(const std::vector<v1::CameraStatus::State>& states,
                                               const std::vector<std::optional<Error>>& refusals) {
  std::vector<MachineEvent> events;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const bool refuses = states[i] == State::LOST && i < refusals.size() && refusals[i];
    const std::string refusal = refuses ? refusals[i]->what : std::string();
    const bool is_news = std::exchange(refusals_[i], refusal) != refusal;
    if (states[i] == states_[i] && !(is_news && gone(states[i]))) continue;
    if (states[i] != states_[i] && gone(states_[i])) events.push_back(mended(states_[i], ids_[i]));
    if (refuses) {
      events.emplace_back(FaultRaised{{v1::Fault::CAMERA_LOST, ids_[i]}, v1::RED, *refusals[i]});
    } else if (gone(states[i])) {
      events.push_back(raised(states[i], ids_[i]));
    }
    if (states[i] == State::ENDED) events.emplace_back(CameraEnded{ids_[i]});
  }
  states_ = states;
  const bool all_lost = !states_.empty() && std::all_of(states_.begin(), states_.end(), gone);
  if (all_lost != all_lost_) {
    const FaultKey key{v1::Fault::ALL_CAMERAS_LOST};
    if (all_lost) {
      events.emplace_back(FaultRaised{key, v1::RED, Why::no_camera_left});
    } else {
      events.emplace_back(FaultMended{key});
    }
    all_lost_ = all_lost;
  }
  return events;
}

std::vector<MachineEvent> DeviceWatch::strobe(const std::string& id, const Status& answer) {
  const FaultKey key{v1::Fault::STROBE_SILENT, id};
  if (answer.ok()) {
    if (!std::exchange(strobe_trouble_, {})) return {};
    return {FaultMended{key}};
  }
  const Error& trouble = answer.error();
  if (strobe_trouble_ == trouble.what) return {};
  strobe_trouble_ = trouble.what;
  return {FaultRaised{key, v1::RED, trouble}};
}

std::vector<MachineEvent> DeviceWatch::clocks(TimePoint monotonic, TimePoint wall) {
  const Seconds ahead = wall - monotonic;
  const Seconds step = ahead - wall_ahead_.value_or(ahead);
  wall_ahead_ = ahead;
  if (abs(step) < kClockStep) return {};
  return {FaultRaised{{v1::Fault::CLOCK_STEPPED}, v1::AMBER, ClockMoved{step}}};
}

void DeviceWatch::frames(const std::vector<drivers::FrameCounts>& counts, TimePoint now) {
  const Seconds span = counted_ ? now - *counted_ : kRateSpan;
  if (span < kRateSpan) return;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const std::uint64_t total = counts[i].made() - counts[i].lost();
    if (counted_) rates_[i] = static_cast<double>(total - came_[i]) / span.value();
    came_[i] = total;
  }
  counted_ = now;
}

bool DeviceWatch::all_film() const { return std::none_of(states_.begin(), states_.end(), gone); }

}  // namespace emberlock::daemon
