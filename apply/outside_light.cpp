// SPDX-License-Identifier: Apache-2.0
#include "apply/outside_light.h"

#include <algorithm>
#include <cmath>

namespace emberlock::apply {
namespace {

constexpr double kFarAway = 1e7;  // metres: beyond all that stands in a scene

Eigen::Vector3d rgb_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// From a place to the light, or far towards it.
Eigen::Vector3d way_to(const recon::Light& light, const Eigen::Vector3d& place) {
  const Eigen::Vector3d stands = rgb_of(light.place);
  return light.source == recon::Light::Source::nearby ? Eigen::Vector3d(stands - place)
                                                      : Eigen::Vector3d(kFarAway * stands.normalized());
}

}  // namespace

double OutsideLight::reaches(const Eigen::Vector3d& place, const Flame* but) const {
  if (light_.source == recon::Light::Source::none) return 1;
  const Eigen::Vector3d way = way_to(light_, place);
  const double distance = way.norm();
  if (!(distance > 0)) return 1;
  if (surfaces_.blocked(place, way / distance, clear_of_surface(place), distance)) return 0;
  double depth = 0;
  for (const Flame* flame : flames_)
    if (flame != but) depth += flame->depth_between(place, place + way);
  return std::exp(-depth);
}

Eigen::Vector3d OutsideLight::on_white(const Eigen::Vector3d& place, const Eigen::Vector3d& normal) const {
  const Eigen::Vector3d even = rgb_of(light_.ambient);
  if (light_.source == recon::Light::Source::none) return even;
  const Eigen::Vector3d way = way_to(light_, place);
  const double cosine = normal.dot(way.normalized());
  if (!(cosine > 0)) return even;
  const double spread = light_.source == recon::Light::Source::nearby ? way.squaredNorm() : 1;
  return even + 4 * cosine / spread * reaches(place) * rgb_of(light_.strength);
}

}  // namespace emberlock::apply
