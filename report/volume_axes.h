// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "recon/views/view.h"

namespace emberlock::report {

/// How a volume is shown to a person: which of the world's axes is up, as the cameras stood, and the two that
/// are level. `across`, `away` and `sign` times `up` are right-handed.
struct ShownAxes {
  int up = 2;
  double sign = 1;  ///< -1: the world's axis points down
  int across = 0;
  int away = 1;

  /// World coordinates (or differences) as (across, away, upwards).
  [[nodiscard]] Eigen::Vector3d shown(const Eigen::Vector3d& world) const;
  [[nodiscard]] std::string up_axis() const;  ///< "z", "-y" and so on
};

/// Of cameras at `positions` whose pictures have `ups` upwards. Up is the world's axis that is nearest to the
/// mean of these; without such a mean (cameras that look down from all around) the one along which the
/// cameras spread least; z without cameras.
ShownAxes shown_axes(const std::vector<Eigen::Vector3d>& positions, const std::vector<Eigen::Vector3d>& ups);
ShownAxes shown_axes(const std::vector<recon::View>& views);

}  // namespace emberlock::report
