// SPDX-License-Identifier: Apache-2.0
#include "recon/views/check_scene.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include <fmt/format.h>

namespace emberlock::recon {
namespace {

bool finite(const CameraModel& camera) {
  const Intrinsics& i = camera.intrinsics;
  const Distortion& d = i.distortion;
  return camera.camera_from_world.rotation.allFinite() && camera.camera_from_world.translation.allFinite() &&
         std::isfinite(i.fx + i.fy + i.cx + i.cy + d.k1 + d.k2 + d.p1 + d.p2 + d.k3) && i.fx != 0 &&
         i.fy != 0;
}

/// By their bits: without branches, so that the loop is vectorized.
bool all_finite(const std::vector<float>& values) {
  constexpr std::uint32_t kExponent = 0x7f800000;
  std::uint32_t bad = 0;
  for (const float v : values) bad |= (std::bit_cast<std::uint32_t>(v) & kExponent) == kExponent ? 1U : 0U;
  return bad == 0;
}

Status check_pixels(const RadianceImage& image, const char* what, const std::string& view) {
  if (all_finite(image.rgb)) return {};
  const auto bad =
      std::find_if(image.rgb.begin(), image.rgb.end(), [](float v) { return !std::isfinite(v); });
  const auto pixel = (bad - image.rgb.begin()) / 3;
  const int width = std::max(1, image.size.width);
  return Error{ErrorKind::bad_input,
               std::string(what) + " (" + std::to_string(pixel % width) + ", " +
                   std::to_string(pixel / width) + ") is not a finite number",
               view, "Replace this frame, or leave the view out"};
}

Status check_view(const View& view) {
  const ImageSize size = view.camera.intrinsics.size;
  const ImageSize own = view.image ? view.image->size : ImageSize{};
  const std::size_t pixels = static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  if (size.width <= 0 || size.height <= 0 || own != size || view.image->rgb.size() != 3 * pixels) {
    return Error{ErrorKind::bad_input,
                 "the image is " + std::to_string(own.width) + " x " + std::to_string(own.height) +
                     ", its camera " + std::to_string(size.width) + " x " + std::to_string(size.height),
                 view.name, "Give the camera the size of the image that it took"};
  }
  if (!finite(view.camera))
    return Error{ErrorKind::bad_input, "the camera has a NaN, an infinite or a zero coefficient", view.name,
                 "Calibrate this camera again"};
  if (view.bounds && view.bounds->size() != pixels) {
    return Error{ErrorKind::bad_input,
                 std::to_string(view.bounds->size()) + " marks of saturated pixels for " +
                     std::to_string(pixels) + " pixels",
                 view.name, "Give a mark for each pixel, or none at all"};
  }
  EMBERLOCK_RETURN_IF_ERROR(check_pixels(*view.image, "pixel", view.name));
  const auto check_beside = [&](const SharedImage& picture, const char* name) -> Status {
    if (!picture) return {};
    if (picture->size != size || picture->rgb.size() != 3 * pixels) {
      return Error{ErrorKind::bad_input,
                   fmt::format("the {} is {} x {}, the image {} x {}", name, picture->size.width,
                               picture->size.height, size.width, size.height),
                   view.name, "Give it the size of the image"};
    }
    return check_pixels(*picture, fmt::format("the {}'s pixel", name).c_str(), view.name);
  };
  EMBERLOCK_RETURN_IF_ERROR(check_beside(view.background, "background"));
  return check_beside(view.average, "average");
}

/// Rays march through the world in single precision: the box must be large against the steps of its numbers
/// there. Smaller ones than these are lengths in another unit.
Status check_place(const Scene& scene) {
  constexpr double kSmallestSide = 1e-4;    // metres
  constexpr double kStepsAlongSide = 4096;  // 16 a voxel of 256
  const double side = scene.box.size.maxCoeff();
  if (side < kSmallestSide) {
    return Error{ErrorKind::bad_input, fmt::format("its longest side is {:.3g} m", side), "box",
                 "Give lengths in metres: boxes from 0.1 mm on are reconstructed"};
  }
  const auto refuse = [&](const Eigen::Vector3d& point, const Eigen::Vector3d& extent,
                          const std::string& where) -> Status {
    const double away = (point.cwiseAbs() + extent).maxCoeff();
    const double step = away * double{std::numeric_limits<float>::epsilon()};
    if (side >= kStepsAlongSide * step) return {};
    return Error{
        ErrorKind::bad_input,
        fmt::format("lies {:.3g} m from the world's origin, where single precision tells no less than "
                    "{:.2g} m apart; the box's longest side is {:.3g} m",
                    away, step, side),
        where, "Move the world's origin into the box, in the cameras' poses too"};
  };
  EMBERLOCK_RETURN_IF_ERROR(refuse(scene.box.center, 0.5 * scene.box.size, "box"));
  for (const View& view : scene.views)
    EMBERLOCK_RETURN_IF_ERROR(refuse(view.camera.center(), Eigen::Vector3d::Zero(), view.name));
  return {};
}

}  // namespace

std::string_view name(ViewRole role) {
  if (role == ViewRole::input) return "input";
  return role == ViewRole::held_out ? "held_out" : "left_out";
}

Status check_scene(const Scene& scene) {
  if (std::none_of(scene.views.begin(), scene.views.end(),
                   [](const View& v) { return v.role == ViewRole::input; }))
    return Error{ErrorKind::bad_input, "no input view", "scene",
                 "Give at least one view that is not held out"};
  if (!scene.box.center.allFinite() || !scene.box.size.allFinite() || scene.box.size.minCoeff() <= 0)
    return Error{ErrorKind::bad_input, "a side is not a positive finite length", "box",
                 "Give cx,cy,cz,sx,sy,sz in metres, every side > 0"};
  for (const View& view : scene.views) EMBERLOCK_RETURN_IF_ERROR(check_view(view));
  return check_place(scene);
}

}  // namespace emberlock::recon
