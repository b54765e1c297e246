// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time_point.h"
#include "daemon/engine/machine.h"
#include "drivers/camera.h"

namespace emberlock::daemon {

/// Turns what devices say of themselves into events for the machine, each told once. Pure but for what it
/// remembers.
class DeviceWatch {
 public:
  /// The wall clock may differ from the monotonic one by this much more than before.
  static constexpr Seconds kClockStep{0.5};
  /// A camera's rate is measured over so long.
  static constexpr Seconds kRateSpan{2};

  explicit DeviceWatch(std::vector<std::string> camera_ids);

  /// `refusals`: by camera, why one that is lost refuses to film, which isn't an absence; empty: none does.
  std::vector<MachineEvent> cameras(const std::vector<v1::CameraStatus::State>& states,
                                    const std::vector<std::optional<Error>>& refusals = {});
  std::vector<MachineEvent> strobe(const std::string& id, const Status& answer);
  std::vector<MachineEvent> clocks(TimePoint monotonic, TimePoint wall);
  void frames(const std::vector<drivers::FrameCounts>& counts, TimePoint now);

  [[nodiscard]] bool all_film() const;
  /// Frames a second that came from the camera lately, without those that were lost; 0 while that isn't
  /// known.
  [[nodiscard]] double rate(std::size_t camera) const { return rates_[camera]; }

 private:
  std::vector<std::string> ids_;
  std::vector<v1::CameraStatus::State> states_;
  std::vector<std::string> refusals_;  ///< by camera, as they were reported last
  bool all_lost_ = false;
  std::optional<std::string> strobe_trouble_;  ///< as it was told last
  std::optional<Seconds> wall_ahead_;
  std::vector<double> rates_;
  std::vector<std::uint64_t> came_;
  std::optional<TimePoint> counted_;
};

}  // namespace emberlock::daemon
