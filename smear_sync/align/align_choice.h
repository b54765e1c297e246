// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "smear_sync/align/align.h"

namespace emberlock::smear {

// The core of the policy: where the cameras stand gives the phase to which they are brought,
// and which of them are reset.

/// For comparisons: times that rounding alone tells apart are equal.
inline std::int64_t in_picoseconds(Seconds t) { return std::llround(t.value() * 1e12); }

/// What a camera's next reset does.
struct ResetLanding {
  ShutterReset method = ShutterReset::on_command;
  std::optional<Seconds> aim;  ///< standard error of where a timed reset lands; absent: it can't be timed
  std::span<const Seconds> shifts;  ///< by which resets by hand have moved tau
  std::string_view model{};         ///< cameras of one model teach each other where resets land
};

/// Cameras of which all phases are known, at one instant.
struct AlignScene {
  AlignPolicy policy = AlignPolicy::densest;
  Seconds period;
  Seconds tolerance;          ///< to the target, that resets have to reach
  std::size_t reference = 0;  ///< of fixed_reference
  std::vector<Seconds> tau;
  std::vector<ResetLanding> landings;

  [[nodiscard]] Seconds error(std::size_t camera, Seconds target) const {
    return wrap_symmetric(tau[camera] - target, period);
  }
  [[nodiscard]] bool within(std::size_t camera, Seconds target) const {
    return in_picoseconds(abs(error(camera, target))) <= in_picoseconds(tolerance);
  }
  [[nodiscard]] bool movable(std::size_t camera) const {
    return landings[camera].method != ShutterReset::none;
  }
  /// Whether its resets are ordered for a moment.
  [[nodiscard]] bool timed(std::size_t camera) const {
    return policy >= AlignPolicy::timed && landings[camera].method == ShutterReset::on_command;
  }
};

/// The chance that a camera's next reset lands within tolerance of the target.
double chance(const AlignScene& scene, std::size_t camera, Seconds target);

/// The phase about which cameras are gathered: the reference's under fixed_reference; else the middle of the
/// group, no wider than twice the tolerance, that leaves the fewest resets to be expected for the others;
/// of equal ones the tightest, which leaves room for more.
Seconds choose_target(const AlignScene& scene);

/// Which of the cameras out of tolerance are reset now.
std::vector<bool> choose_resets(const AlignScene& scene, Seconds target);

}  // namespace emberlock::smear
