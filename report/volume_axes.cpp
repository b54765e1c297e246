// SPDX-License-Identifier: Apache-2.0
#include "report/volume_axes.h"

#include <utility>

namespace emberlock::report {

Eigen::Vector3d ShownAxes::shown(const Eigen::Vector3d& world) const {
  return {world[across], world[away], sign * world[up]};
}

std::string ShownAxes::up_axis() const {
  return std::string(sign < 0 ? "-" : "") + static_cast<char>('x' + up);
}

ShownAxes shown_axes(const std::vector<Eigen::Vector3d>& positions, const std::vector<Eigen::Vector3d>& ups) {
  constexpr double kAgreed = 0.3;  // length of the mean
  ShownAxes axes;
  if (positions.empty()) return axes;
  Eigen::Vector3d upwards = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& up : ups) upwards += up;
  Eigen::Vector3d low = positions.front();
  Eigen::Vector3d high = low;
  for (const Eigen::Vector3d& position : positions) {
    low = low.cwiseMin(position);
    high = high.cwiseMax(position);
  }
  if (upwards.norm() > kAgreed * static_cast<double>(ups.size())) {
    upwards.cwiseAbs().maxCoeff(&axes.up);
    axes.sign = upwards[axes.up] < 0 ? -1 : 1;
  } else {
    (high - low).minCoeff(&axes.up);
  }
  axes.across = (axes.up + 1) % 3;
  axes.away = (axes.up + 2) % 3;
  if (axes.sign < 0) std::swap(axes.across, axes.away);
  return axes;
}

ShownAxes shown_axes(const std::vector<recon::View>& views) {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector3d> ups;
  for (const recon::View& view : views) {
    positions.push_back(view.camera.center());
    ups.emplace_back(-view.camera.camera_from_world.rotation.row(1).transpose());
  }
  return shown_axes(positions, ups);
}

}  // namespace emberlock::report
