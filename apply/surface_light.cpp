// SPDX-License-Identifier: Apache-2.0
#include "apply/surface_light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

namespace emberlock::apply {
namespace {

/// So far from a surface its own rounding ends, metres.
double clear_of_surface(const Eigen::Vector3d& place) { return 1e-5 * (1 + place.cwiseAbs().maxCoeff()); }

}  // namespace

SurfaceLight::SurfaceLight(const std::vector<const Flame*>& flames, const Surfaces& surfaces)
    : flames_(flames), surfaces_(surfaces) {
  if (surfaces.empty()) return;
  double sum = 0;
  for (std::size_t f = 0; f < flames.size(); ++f)
    for (const Flame::Emitter& e : flames[f]->emitters()) {
      sum += e.power;
      emitters_.push_back({static_cast<std::uint32_t>(f), e.voxel});
      power_until_.push_back(sum);
    }
}

Eigen::Vector3d SurfaceLight::sample(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                     const Draw& draw, RayLight& scratch) const {
  if (emitters_.empty()) return Eigen::Vector3d::Zero();
  const bool near =
      std::any_of(flames_.begin(), flames_.end(), [&](const Flame* f) { return f->near(place); });
  Eigen::Vector3d light = from_afar(place, normal, draw);
  if (near) light += from_nearby(place, normal, draw, scratch);
  return light;
}

Eigen::Vector3d SurfaceLight::from_afar(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                        const Draw& draw) const {
  const double all = power_until_.back();
  const auto chosen = std::min(
      static_cast<std::size_t>(std::upper_bound(power_until_.begin(), power_until_.end(), draw.voxel * all) -
                               power_until_.begin()),
      emitters_.size() - 1);
  const Emitter& emitter = emitters_[chosen];
  const Flame& flame = *flames_[emitter.flame];
  if (flame.near(place)) return Eigen::Vector3d::Zero();
  const double power = power_until_[chosen] - (chosen > 0 ? power_until_[chosen - 1] : 0);
  const Flame::Sent sent = flame.sent(emitter.voxel, {draw.within[0], draw.within[1], draw.within[2]});
  const Eigen::Vector3d towards = sent.place - place;
  const double distance = towards.norm();
  const double cosine = normal.dot(towards) / distance;
  if (!(cosine > 0)) return Eigen::Vector3d::Zero();
  if (surfaces_.blocked(place, towards / distance, clear_of_surface(place), distance))
    return Eigen::Vector3d::Zero();
  double depth = 0;
  for (const Flame* f : flames_) depth += f->depth_between(place, sent.place);
  return (all / power * std::exp(-depth) * cosine / (distance * distance)) * sent.power;
}

Eigen::Vector3d SurfaceLight::from_nearby(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                          const Draw& draw, RayLight& scratch) const {
  const double radius = std::sqrt(draw.towards[0]);
  const double angle = 2 * std::numbers::pi * draw.towards[1];
  const Eigen::Vector3d across = normal.unitOrthogonal();
  const Eigen::Vector3d direction =
      radius * (std::cos(angle) * across + std::sin(angle) * normal.cross(across)) +
      std::sqrt(1 - draw.towards[0]) * normal;
  scratch.clear();
  for (const Flame* f : flames_)
    f->add_coarse_steps(place, direction, f->near(place) ? Flame::Glow::shown : Flame::Glow::hidden, scratch);
  scratch.merge();
  const std::optional<Surfaces::Hit> hit = surfaces_.first(place, direction, clear_of_surface(place));
  const recon::Rgba radiance = hit ? scratch.up_to(static_cast<float>(hit->distance)) : scratch.all();
  return std::numbers::pi * Eigen::Vector3f(radiance.c[0], radiance.c[1], radiance.c[2]).cast<double>();
}

}  // namespace emberlock::apply
