// SPDX-License-Identifier: Apache-2.0
#include "apply/plate_light.h"

#include <algorithm>
#include <cmath>

namespace emberlock::apply {
namespace {

/// What places of a flame send to a place of the plate.
class PlateSum {
 public:
  explicit PlateSum(const Flame& flame) : flame_(flame.table()) {
    for (const Flame::Emitter& e : flame.emitters()) {
      Middle& middle = middles_.emplace_back();
      middle.voxel = e.voxel;
      flame_.sent(e.voxel, {0.5F, 0.5F, 0.5F}, middle.place, middle.power);
    }
  }
  [[nodiscard]] Eigen::Vector3f at(const Vec3& place) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Middle& middle : middles_) {
      constexpr float kNear = 4;
      if (length(middle.place - place) > kNear * flame_.coarse_meters)
        sum += arriving(middle.place, middle.power, place);
      else
        sum += from_close_by(middle.voxel, place);
    }
    return sum.cast<float>();
  }

 private:
  struct Middle {
    Vec3 place, power;
    std::uint32_t voxel = 0;
  };
  [[nodiscard]] Eigen::Vector3d from_close_by(std::uint32_t voxel, const Vec3& place) const {
    constexpr int kParts = 4;
    const auto middle = [](int part) { return (static_cast<float>(part) + 0.5F) / kParts; };
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int part = 0; part < kParts * kParts * kParts; ++part) {
      Vec3 from;
      Vec3 power;
      flame_.sent(voxel,
                  {middle(part % kParts), middle(part / kParts % kParts), middle(part / (kParts * kParts))},
                  from, power);
      sum += arriving(from, power, place);
    }
    return sum / (kParts * kParts * kParts);
  }
  [[nodiscard]] Eigen::Vector3d arriving(const Vec3& from, const Vec3& power, const Vec3& place) const {
    const Vec3 towards = from - place;
    if (!(towards.z > 0)) return Eigen::Vector3d::Zero();
    const float distance = length(towards);
    const float through = std::exp(-flame_.depth(place, (1 / distance) * towards, distance));
    return Eigen::Vector3f(power.x, power.y, power.z).cast<double>() *
           static_cast<double>(towards.z / (distance * distance * distance) * through);
  }

  FlameTable flame_;
  std::vector<Middle> middles_;
};

}  // namespace

PlateLight::PlateLight(const Flame& flame, double edge, int points, recon::Pool& pool)
    : edge_(edge), points_(points) {
  irradiance_.resize(static_cast<std::size_t>(points) * static_cast<std::size_t>(points),
                     Eigen::Vector3f::Zero());
  const PlateSum sum(flame);
  const double spacing = edge / (points - 1);
  pool.run(points, [&](int row) {
    for (int i = 0; i < points; ++i)
      irradiance_[static_cast<std::size_t>(row) * static_cast<std::size_t>(points) +
                  static_cast<std::size_t>(i)] = sum.at({static_cast<float>(i * spacing - edge / 2),
                                                         static_cast<float>(row * spacing - edge / 2), 0});
  });
}

Eigen::Vector3f PlateLight::at(float x, float y) const {
  const auto half = static_cast<float>(edge_ / 2);
  const float inside = half - std::max(std::abs(x), std::abs(y));
  if (!(inside > 0)) return Eigen::Vector3f::Zero();
  const float per_spacing = static_cast<float>(points_ - 1) / (2 * half);
  const float u = (x + half) * per_spacing;
  const float v = (y + half) * per_spacing;
  const int i = std::min(static_cast<int>(u), points_ - 2);
  const int j = std::min(static_cast<int>(v), points_ - 2);
  const float fx = u - static_cast<float>(i);
  const float fy = v - static_cast<float>(j);
  const Eigen::Vector3f* p = &irradiance_[static_cast<std::size_t>(j) * static_cast<std::size_t>(points_) +
                                          static_cast<std::size_t>(i)];
  const Eigen::Vector3f light =
      (1 - fy) * ((1 - fx) * p[0] + fx * p[1]) + fy * ((1 - fx) * p[points_] + fx * p[points_ + 1]);
  constexpr float kFades = 0.1F;
  return std::min(1.0F, inside / (kFades * 2 * half)) * light;
}

}  // namespace emberlock::apply
