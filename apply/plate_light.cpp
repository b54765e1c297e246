// SPDX-License-Identifier: Apache-2.0
#include "apply/plate_light.h"

#include <algorithm>
#include <cmath>

namespace emberlock::apply {
namespace {

/// What places of a flame send to a place of the plate.
class PlateSum {
 public:
  explicit PlateSum(const Flame& flame) : flame_(flame) {
    for (const Flame::Emitter& e : flame.emitters()) {
      const Flame::Sent middle = flame.sent(e.voxel, Eigen::Vector3d::Constant(0.5));
      middles_.push_back({middle.place, middle.power, e.voxel});
    }
    edge_ = flame.light_edge();
  }
  [[nodiscard]] Eigen::Vector3f at(const Eigen::Vector3d& place) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    constexpr double kNear = 4;
    constexpr int kParts = 4;
    for (const Middle& middle : middles_) {
      if ((middle.place - place).squaredNorm() > kNear * kNear * edge_ * edge_) {
        sum += arriving({middle.place, middle.power}, place);
        continue;
      }
      for (int part = 0; part < kParts * kParts * kParts; ++part) {
        const Eigen::Vector3d within(part % kParts, part / kParts % kParts, part / (kParts * kParts));
        const Flame::Sent sent =
            flame_.sent(middle.voxel, (within + Eigen::Vector3d::Constant(0.5)) / kParts);
        sum += arriving(sent, place) / (kParts * kParts * kParts);
      }
    }
    return sum.cast<float>();
  }

 private:
  struct Middle {
    Eigen::Vector3d place, power;
    std::uint32_t voxel;
  };
  [[nodiscard]] Eigen::Vector3d arriving(const Flame::Sent& sent, const Eigen::Vector3d& place) const {
    const Eigen::Vector3d towards = sent.place - place;
    if (!(towards.z() > 0)) return Eigen::Vector3d::Zero();
    const double squared = towards.squaredNorm();
    return towards.z() / (squared * std::sqrt(squared)) * std::exp(-flame_.depth_between(place, sent.place)) *
           sent.power;
  }

  const Flame& flame_;
  double edge_ = 0;
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
                  static_cast<std::size_t>(i)] =
          sum.at({i * spacing - edge / 2, row * spacing - edge / 2, 0});
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
