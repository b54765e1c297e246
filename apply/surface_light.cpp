// SPDX-License-Identifier: Apache-2.0
#include "apply/surface_light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

namespace emberlock::apply {
namespace {

constexpr int kProposals = 8;
constexpr int kFirstOfProposals = 2;  // of a draw's numbers; those before are the ray's
static_assert(kFirstOfProposals + 5 * kProposals <= SurfaceLight::Draw::kEach);

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
  constexpr std::size_t kShares = 4096;
  std::uint32_t emitter = 0;
  for (std::size_t s = 0; s < kShares && !emitters_.empty(); ++s) {
    while (emitter + 1 < emitters_.size() && power_until_[emitter] <= sum * static_cast<double>(s) / kShares)
      ++emitter;
    guide_.push_back(emitter);
  }
}

Eigen::Vector3d SurfaceLight::sample(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                     const Draw& draw, Scratch& scratch) const {
  if (emitters_.empty()) return Eigen::Vector3d::Zero();
  scratch.close_by.clear();
  for (const Flame* f : flames_) scratch.close_by.push_back(f->close_by(place));
  Eigen::Vector3d light = from_one_place(place, normal, draw, scratch.close_by);
  if (std::any_of(scratch.close_by.begin(), scratch.close_by.end(), [](double a) { return a > 0; }))
    light += along_a_ray(place, normal, draw, scratch);
  return light;
}

SurfaceLight::Proposal SurfaceLight::proposed(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                              double which, const Eigen::Vector3d& within,
                                              const std::vector<double>& close_by) const {
  const double all = power_until_.back();
  const auto share = static_cast<std::size_t>(which * static_cast<double>(guide_.size()));
  std::size_t chosen = guide_[std::min(share, guide_.size() - 1)];
  while (chosen + 1 < emitters_.size() && power_until_[chosen] <= which * all) ++chosen;
  const Flame& flame = *flames_[emitters_[chosen].flame];
  const double power = power_until_[chosen] - (chosen > 0 ? power_until_[chosen - 1] : 0);
  const Flame::Sent sent = flame.sent(emitters_[chosen].voxel, within);
  const Eigen::Vector3d towards = sent.place - place;
  const double squared = towards.squaredNorm();
  const double cosine = normal.dot(towards) / std::sqrt(squared);
  if (!(cosine > 0)) return {sent.place};
  const double a = close_by[emitters_[chosen].flame];
  return {sent.place, (all / power * cosine / (squared + a * a)) * sent.power};
}

Eigen::Vector3d SurfaceLight::from_one_place(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                             const Draw& draw, const std::vector<double>& close_by) const {
  double sum = 0;
  Proposal taken;
  for (int i = 0; i < kProposals; ++i) {
    const int first = kFirstOfProposals + 5 * i;
    const Proposal one =
        proposed(place, normal, (i + draw.spread(first)) / kProposals,
                 {draw.number(first + 1), draw.number(first + 2), draw.number(first + 3)}, close_by);
    const double light = one.irradiance.sum();
    sum += light;
    if (light > 0 && draw.number(first + 4) * sum < light) taken = one;  // each with its share of the sum
  }
  if (!(sum > 0)) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d towards = taken.place - place;
  const double distance = towards.norm();
  if (surfaces_.blocked(place, towards / distance, clear_of_surface(place), distance))
    return Eigen::Vector3d::Zero();
  double depth = 0;
  for (const Flame* f : flames_) depth += f->depth_between(place, taken.place);
  return (sum / (kProposals * taken.irradiance.sum()) * std::exp(-depth)) * taken.irradiance;
}

Eigen::Vector3d SurfaceLight::along_a_ray(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                          const Draw& draw, Scratch& scratch) const {
  const double outwards = draw.spread(0);
  const double radius = std::sqrt(outwards);
  const double angle = 2 * std::numbers::pi * draw.number(1);
  const Eigen::Vector3d across = normal.unitOrthogonal();
  const Eigen::Vector3d direction =
      radius * (std::cos(angle) * across + std::sin(angle) * normal.cross(across)) +
      std::sqrt(1 - outwards) * normal;
  scratch.along.clear();
  for (std::size_t f = 0; f < flames_.size(); ++f)
    flames_[f]->add_coarse_steps(place, direction, scratch.close_by[f], scratch.along);
  scratch.along.merge();
  const std::optional<Surfaces::Hit> hit = surfaces_.first(place, direction, clear_of_surface(place));
  const recon::Rgba radiance =
      hit ? scratch.along.up_to(static_cast<float>(hit->distance)) : scratch.along.all();
  return std::numbers::pi * Eigen::Vector3f(radiance.c[0], radiance.c[1], radiance.c[2]).cast<double>();
}

}  // namespace emberlock::apply
