// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/voxel_glow.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Dense>

namespace emberlock::recon {
namespace {

constexpr double kLeastShare = 2e-3;      // of a level: what the response and the march leave
constexpr double kAbsorptionShare = 0.5;  // of the extinction: how well pictures tell where it is
constexpr double kWhite = 254.5;          // levels

}  // namespace

Saturation::Saturation(const Scene& scene) {
  for (const View& view : scene.views) {
    if (view.role != ViewRole::input) continue;
    const bool any = view.bounds != nullptr || std::any_of(view.image->rgb.begin(), view.image->rgb.end(),
                                                           [](float v) { return v >= kWhite; });
    any_ = any_ || any;
    views_.push_back(&view);
  }
}

bool Saturation::at(const Eigen::Vector3d& point) const {
  if (!any_) return false;
  std::size_t seen = 0;
  std::size_t bound = 0;
  for (const View* view : views_) {
    if (!((view->camera.camera_from_world * point).z() > 0)) continue;
    const Eigen::Vector2d at = view->camera.project(point);
    const ImageSize size = view->image->size;
    if (!(at.x() >= 0 && at.y() >= 0 && at.x() < size.width && at.y() < size.height)) continue;
    const auto pixel = static_cast<std::size_t>(at.y()) * static_cast<std::size_t>(size.width) +
                       static_cast<std::size_t>(at.x());
    if (view->bounds && is_left_out((*view->bounds)[pixel])) continue;
    ++seen;
    const float* rgb = &view->image->rgb[3 * pixel];
    const bool white = std::max({rgb[0], rgb[1], rgb[2]}) >= kWhite;
    bound += white || (view->bounds != nullptr && is_saturated((*view->bounds)[pixel])) ? 1 : 0;
  }
  return 2 * bound > seen;
}

VoxelGlow::VoxelGlow(const Reconstruction& done, const VolumeErrors& errors, const EmitterTable& table,
                     SelfAbsorption own, const CameraResponse& response, double brightest)
    : volume_(done.volume),
      errors_(errors),
      own_(std::move(own)),
      paper_(table.emitter() == Emitter::paper),
      by_absorption_(!paper_ && table.absolute() && !volume_.extinction.empty() &&
                     !errors.extinction.empty() && done.effects.scattering.order == Scattering::Order::none),
      brightest_(brightest),
      opacity_(-std::log1p(-kPaperOpacityOfAStep) / static_cast<double>(volume_.grid.edge)) {
  for (std::size_t c = 0; c < 3; ++c) dead_[c] = is_dead(response, c);
}

Glow VoxelGlow::at(std::size_t point, Beside beside) const {
  Glow glow;
  glow.level = Eigen::Vector3f::Map(&volume_.emission[3 * point]).cast<double>();
  Eigen::Matrix3d covariance = errors_.covariance(point);
  if (!own_.factor.empty()) {
    const Eigen::Vector3d factor = Eigen::Vector3f::Map(&own_.factor[3 * point]).cast<double>();
    glow.level = glow.level.cwiseProduct(factor);
    covariance = factor.asDiagonal() * covariance * factor.asDiagonal();
    if (beside == Beside::lines) {
      // They may shine where there is no soot, and the extinction that is found there be wrong.
      const Eigen::Vector3d doubt = kAbsorptionShare * glow.level.cwiseProduct(factor.array().log().matrix());
      covariance += doubt * doubt.transpose();
    }
  }
  const double least = std::hypot(kLeastShare * glow.level.maxCoeff(), 1e-4 * brightest_);
  covariance.diagonal().array() += least * least;
  if (paper_) {
    glow.information(1, 1) = 1 / covariance(1, 1);
    glow.absorption = opacity_;
    glow.absorption_sigma = 1e-6 * opacity_;
    return glow;
  }
  for (Eigen::Index c = 0; c < 3; ++c) {
    if (!dead_[static_cast<std::size_t>(c)]) continue;
    covariance.row(c).setZero();
    covariance.col(c).setZero();
    covariance(c, c) = 1;
  }
  glow.information = covariance.inverse();
  for (Eigen::Index c = 0; c < 3; ++c)
    if (dead_[static_cast<std::size_t>(c)]) glow.information(c, c) = 0;
  if (by_absorption_ && volume_.extinction[point] > 0) {
    glow.absorption = static_cast<double>(volume_.extinction[point]) / own_.reference;
    glow.absorption_sigma = std::hypot(static_cast<double>(errors_.extinction[point]) / own_.reference,
                                       kAbsorptionShare * glow.absorption);
  }
  return glow;
}

}  // namespace emberlock::recon
