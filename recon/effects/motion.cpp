// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/motion.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "recon/views/flame_mask.h"

namespace emberlock::recon {
namespace {

constexpr double kFaintest = 0.1;  // grey levels: darker parts of a picture aren't moved
constexpr int kLattice = 16;       // pixels between two places where the displacement is worked out

Eigen::Vector3d way(const View& view, const Motion& motion) {
  return view.lateness.value() * Eigen::Vector3d(motion.velocity[0], motion.velocity[1], motion.velocity[2]);
}

/// Where a view's own camera sees what the moved one sees at a pixel, in the plane through the flame across
/// its axis; displacements at every kLattice-th pixel, linear between them, because they are smooth.
class Displacement {
 public:
  Displacement(const View& view, const Motion& motion, const Eigen::Vector3d& flame)
      : own_(view.camera), moved_(camera_at_instant(view, motion)) {
    const ImageSize size = own_.intrinsics.size;
    columns_ = size.width / kLattice + 2;
    depth_ = (moved_.camera_from_world * flame).z();
    for (int row = 0; row * kLattice < size.height + kLattice; ++row)
      for (int column = 0; column < columns_; ++column)
        at_.push_back(at({kLattice * column + 0.5, kLattice * row + 0.5}));
  }

  [[nodiscard]] double longest() const {
    double most = 0;
    for (const Eigen::Vector2d& d : at_) most = std::max(most, d.cwiseAbs().maxCoeff());
    return most;
  }
  /// Of pixel (x, y).
  [[nodiscard]] Eigen::Vector2d operator()(int x, int y) const {
    const auto first = static_cast<std::size_t>(y / kLattice) * static_cast<std::size_t>(columns_) +
                       static_cast<std::size_t>(x / kLattice);
    const double fx = static_cast<double>(x % kLattice) / kLattice;
    const double fy = static_cast<double>(y % kLattice) / kLattice;
    const std::size_t below = first + static_cast<std::size_t>(columns_);
    return (1 - fy) * ((1 - fx) * at_[first] + fx * at_[first + 1]) +
           fy * ((1 - fx) * at_[below] + fx * at_[below + 1]);
  }

 private:
  [[nodiscard]] Eigen::Vector2d at(const Eigen::Vector2d& pixel) const {
    const Ray ray = moved_.ray(pixel);
    const double along = ray.direction.dot(moved_.camera_from_world.rotation.row(2));
    if (depth_ <= 0 || along <= 0) return Eigen::Vector2d::Zero();
    const Eigen::Vector3d point = ray.origin + depth_ / along * ray.direction;
    if ((own_.camera_from_world * point).z() <= 0) return Eigen::Vector2d::Zero();
    const Eigen::Vector2d moved = own_.project(point) - pixel;
    return moved.allFinite() ? moved : Eigen::Vector2d::Zero().eval();
  }

  const CameraModel& own_;
  CameraModel moved_;
  double depth_ = 0;
  int columns_ = 0;
  std::vector<Eigen::Vector2d> at_;
};

/// Bilinear between pixel centres, black outside; (x, y) counts from the centre of the first pixel.
float value_at(const RadianceImage& image, const Eigen::Vector2d& at, std::size_t channel) {
  const double left = std::floor(at.x());
  const double top = std::floor(at.y());
  const auto value = [&](double x, double y) {
    if (!(x >= 0 && y >= 0 && x < image.size.width && y < image.size.height)) return 0.F;
    const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.size.width) +
                       static_cast<std::size_t>(x);
    return image.rgb[3 * pixel + channel];
  };
  const auto fx = static_cast<float>(at.x() - left);
  const auto fy = static_cast<float>(at.y() - top);
  return (1 - fy) * ((1 - fx) * value(left, top) + fx * value(left + 1, top)) +
         fy * ((1 - fx) * value(left, top + 1) + fx * value(left + 1, top + 1));
}

}  // namespace

bool moves(const Scene& scene, const Motion& motion) {
  const auto still = [](double v) { return v == 0; };
  if (motion.carry == Motion::Carry::none ||
      std::all_of(motion.velocity.begin(), motion.velocity.end(), still))
    return false;
  return std::any_of(scene.views.begin(), scene.views.end(),
                     [](const View& view) { return view.lateness != Seconds(0); });
}

Status check_carried(const Scene& scene, const Motion& motion) {
  if (!moves(scene, motion)) return {};
  const double most = 0.5 * scene.box.size.maxCoeff();
  for (const View& view : scene.views) {
    const double carried = way(view, motion).norm();
    if (carried <= most) continue;
    return Error{
        ErrorKind::refused,
        fmt::format("is {:.1f} ms from the instant, and the flame moves {:.0f} mm meanwhile, more than "
                    "half of its box: its picture shows another flame",
                    in_milliseconds(view.lateness), 1e3 * carried),
        "view " + view.name, "Film at a higher rate, or reconstruct frames of cameras that film at once"};
  }
  return {};
}

CameraModel camera_at_instant(const View& view, const Motion& motion) {
  CameraModel camera = view.camera;
  camera.camera_from_world.translation += camera.camera_from_world.rotation * way(view, motion);
  return camera;
}

RadianceImage change_of_place(const RadianceImage& picture, const View& view, const Motion& motion,
                              const Eigen::Vector3d& flame) {
  RadianceImage change(picture.size);
  const PixelBox lit = flame_mask(picture, kFaintest).box;
  if (lit.empty()) return change;
  const Displacement displacement(view, motion, flame);
  const int reach = static_cast<int>(std::ceil(
      std::min(displacement.longest(), static_cast<double>(picture.size.width + picture.size.height))));
  for (int y = std::max(0, lit.y0 - reach); y < std::min(picture.size.height, lit.y1 + reach); ++y)
    for (int x = std::max(0, lit.x0 - reach); x < std::min(picture.size.width, lit.x1 + reach); ++x) {
      const Eigen::Vector2d from = Eigen::Vector2d(x, y) + displacement(x, y);
      const std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.size.width) +
                                static_cast<std::size_t>(x);
      for (std::size_t c = 0; c < 3; ++c)
        change.rgb[3 * pixel + c] = picture.rgb[3 * pixel + c] - value_at(picture, from, c);
    }
  return change;
}

void bring_to_instant(View& view, const Motion& motion, const Eigen::Vector3d& flame, double white) {
  if (view.lateness == Seconds(0)) return;
  if (view.average) {
    RadianceImage steady = *view.average;
    if (view.background)
      for (std::size_t i = 0; i < steady.rgb.size(); ++i) steady.rgb[i] -= view.background->rgb[i];
    const RadianceImage change = change_of_place(steady, view, motion, flame);
    const auto bound = static_cast<float>(white);
    RadianceImage image = *view.image;
    for (std::size_t i = 0; i < change.rgb.size(); ++i) {
      float& value = image.rgb[i];
      // There is no light below black, which noise alone reaches.
      if (change.rgb[i] != 0 && (white <= 0 || value < bound))
        value = std::max(std::min(value, 0.F), value - change.rgb[i]);
    }
    view.image = share(std::move(image));
  }
  view.camera = camera_at_instant(view, motion);
}

Scene at_one_instant(Scene scene, const Motion& motion, double white) {
  for (View& view : scene.views) {
    bring_to_instant(view, motion, scene.box.center, white);
    view.average.reset();
  }
  return scene;
}

}  // namespace emberlock::recon
