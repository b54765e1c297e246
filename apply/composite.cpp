// SPDX-License-Identifier: Apache-2.0
#include "apply/composite.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace emberlock::apply {
namespace {

constexpr float kEndless = std::numeric_limits<float>::max();

/// Rays of a camera against the plate.
class PlateRays {
 public:
  PlateRays(const recon::CameraModel& camera, const std::vector<Eigen::Vector2f>& directions, double edge)
      : directions_(directions),
        origin_(camera.center().cast<float>()),
        turn_(camera.camera_from_world.rotation.transpose().cast<float>()),
        half_(static_cast<float>(edge / 2)) {}

  struct Hit {
    float depth = kEndless;  ///< along the camera's axis; endless where the plate isn't hit
    float x = 0, y = 0;      ///< on the plate
  };
  [[nodiscard]] Hit operator()(std::size_t pixel) const {
    const Eigen::Vector2f& d = directions_[pixel];
    const Eigen::Vector3f along = turn_ * Eigen::Vector3f(d.x(), d.y(), 1);
    const float depth = -origin_.z() / along.z();
    if (!(depth > 0 && depth < kEndless)) return {};
    const float x = origin_.x() + depth * along.x();
    const float y = origin_.y() + depth * along.y();
    if (!(std::max(std::abs(x), std::abs(y)) < half_)) return {};
    return {depth, x, y};
  }
  /// Metres along the ray, of one along the axis.
  [[nodiscard]] float stretch(std::size_t pixel) const {
    return std::sqrt(1 + directions_[pixel].squaredNorm());
  }

 private:
  const std::vector<Eigen::Vector2f>& directions_;
  Eigen::Vector3f origin_;
  Eigen::Matrix3f turn_;
  float half_;
};

/// Whether what a depth picture shows is nearer than the plate, by more than it may be wrong.
bool before_plate(float seen, float plate) {
  constexpr float kShare = 0.02F;
  constexpr float kMetres = 0.005F;
  return seen < plate - kMetres - kShare * plate;
}

}  // namespace

Composite::Composite(const recon::Intrinsics& lens, const Marker& marker, Transfer::Curve curve,
                     const CompositeOptions& options)
    : lens_(lens), marker_size_(marker.size()), transfer_(curve), options_(options) {
  const ImageSize size = lens.size;
  direction_.reserve(static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height));
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      double u = (x + 0.5 - lens.cx) / lens.fx;
      double v = (y + 0.5 - lens.cy) / lens.fy;
      lens.distortion.undistort(u, v);
      direction_.emplace_back(static_cast<float>(u), static_cast<float>(v));
    }
}

void Composite::take_white(const Image& frame, const recon::Rigid3& camera_from_marker) {
  const recon::CameraModel camera{lens_, camera_from_marker};
  constexpr int kAcross = 40;
  constexpr double kMargin = 1.16;  // half a cell of the white around the marker
  constexpr double kRank = 0.85;    // more than a tenth of what is looked at is white, and some of it glares
  std::array<std::vector<std::uint8_t>, 3> levels;
  for (int j = 0; j < kAcross; ++j)
    for (int i = 0; i < kAcross; ++i) {
      const Eigen::Vector2d share((i + 0.5) / kAcross - 0.5, (j + 0.5) / kAcross - 0.5);
      const Eigen::Vector2d on_plate = kMargin * share.cwiseProduct(marker_size_);
      const Eigen::Vector3d place(on_plate.x(), on_plate.y(), 0);
      if (!((camera.camera_from_world * place).z() > 0)) continue;
      const Eigen::Vector2d pixel = camera.project(place);
      if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < lens_.size.width &&
            pixel.y() < lens_.size.height))
        continue;
      const auto* p = frame.view().row_as<std::uint8_t>(static_cast<int>(pixel.y())) +
                      3 * static_cast<std::ptrdiff_t>(pixel.x());
      for (std::size_t c = 0; c < 3; ++c) levels[c].push_back(p[c]);
    }
  if (levels[0].size() < kAcross) return;
  constexpr double kFollows = 0.1;  // of what a frame differs
  const double share = white_.isZero() ? 1 : kFollows;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto rank = static_cast<std::ptrdiff_t>(kRank * static_cast<double>(levels[c].size()));
    std::nth_element(levels[c].begin(), levels[c].begin() + rank, levels[c].end());
    double& white = white_[static_cast<Eigen::Index>(c)];
    white +=
        share * (static_cast<double>(transfer_.light(levels[c][static_cast<std::size_t>(rank)])) - white);
  }
}

void Composite::draw(const Flame& flame, const PlateLight& light, const recon::Rigid3& camera_from_marker,
                     const InFront& front, double shown, Image& frame, recon::Pool& pool) const {
  const recon::CameraModel camera{lens_, camera_from_marker};
  const ImageSize size = lens_.size;
  const PlateRays plate(camera, direction_, light.edge());
  std::vector<float> until(direction_.size(), kEndless);
  std::vector<PlateRays::Hit> hits(direction_.size());
  pool.run(size.height, [&](int y) {
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width);
    for (std::size_t p = first; p < first + static_cast<std::size_t>(size.width); ++p) {
      hits[p] = plate(p);
      float depth = hits[p].depth;
      if (!front.depth.empty() && front.depth[p] > 0) {
        if (before_plate(front.depth[p], depth)) hits[p].depth = kEndless;
        depth = std::min(depth, front.depth[p]);
      }
      if (depth < kEndless) until[p] = depth * plate.stretch(p);
    }
  });
  Flame::View view = flame.seen_by(camera, options_.step, pool);
  const std::vector<recon::Rgba> marched = flame.marched(view, until, pool);
  Eigen::Vector3f gain = Eigen::Vector3f::Zero();  // of the irradiance
  for (int c = 0; c < 3; ++c)
    if (white_[c] > 0) gain[c] = static_cast<float>(options_.albedo / (std::numbers::pi * white_[c]));
  pool.run(size.height, [&](int y) {
    const std::size_t first = static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width);
    auto* row = frame.row_as<std::uint8_t>(y);
    for (std::size_t x = 0; x < static_cast<std::size_t>(size.width); ++x) {
      const std::size_t p = first + x;
      float share = static_cast<float>(shown);
      if (!front.mask.empty()) share *= 1 - static_cast<float>(front.mask[p]) / 255;
      const std::int32_t ray = view.ray_of_pixel[p];
      if (!(share > 0) || (ray < 0 && hits[p].depth == kEndless)) continue;
      recon::Rgba seen{{0, 0, 0, 1}};
      if (ray >= 0) seen = marched[static_cast<std::size_t>(ray)];
      Eigen::Vector3f lit = Eigen::Vector3f::Zero();
      if (hits[p].depth < kEndless) lit = light.at(hits[p].x, hits[p].y).cwiseProduct(gain);
      for (int c = 0; c < 3; ++c) {
        std::uint8_t& level = row[3 * x + static_cast<std::size_t>(c)];
        const float before = transfer_.light(level);
        const float drawn = seen.c[c] + seen.c[3] * before * (1 + lit[c]);
        level = transfer_.level(before + share * (drawn - before));
      }
    }
  });
}

}  // namespace emberlock::apply
