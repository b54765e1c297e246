// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/flame_mask.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <fmt/format.h>

namespace emberlock::recon {
namespace {

float brightness(const float* rgb) { return std::max({rgb[0], rgb[1], rgb[2]}); }

template <class Values>
double median(Values& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

bool finite(const CameraModel& camera) {
  const Intrinsics& i = camera.intrinsics;
  const Distortion& d = i.distortion;
  return camera.camera_from_world.rotation.allFinite() && camera.camera_from_world.translation.allFinite() &&
         std::isfinite(i.fx + i.fy + i.cx + i.cy + d.k1 + d.k2 + d.p1 + d.p2 + d.k3) && i.fx != 0 &&
         i.fy != 0;
}

Status check_pixels(const RadianceImage& image, const char* what, const std::string& view) {
  const auto bad =
      std::find_if(image.rgb.begin(), image.rgb.end(), [](float v) { return !std::isfinite(v); });
  if (bad == image.rgb.end()) return {};
  const auto pixel = (bad - image.rgb.begin()) / 3;
  const int width = std::max(1, image.size.width);
  return Error{ErrorKind::bad_input,
               std::string(what) + " (" + std::to_string(pixel % width) + ", " +
                   std::to_string(pixel / width) + ") is not a finite number",
               view, "Replace this frame, or leave the view out"};
}

Status check_view(const View& view) {
  const ImageSize size = view.camera.intrinsics.size;
  if (size.width <= 0 || size.height <= 0 || view.image.size != size ||
      view.image.rgb.size() !=
          3 * static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height)) {
    return Error{ErrorKind::bad_input,
                 "the image is " + std::to_string(view.image.size.width) + " x " +
                     std::to_string(view.image.size.height) + ", its camera " + std::to_string(size.width) +
                     " x " + std::to_string(size.height),
                 view.name, "Give the camera the size of the image that it took"};
  }
  if (!finite(view.camera))
    return Error{ErrorKind::bad_input, "the camera has a NaN, an infinite or a zero coefficient", view.name,
                 "Calibrate this camera again"};
  if (!view.bounds.empty() && view.bounds.size() != view.image.rgb.size() / 3) {
    return Error{ErrorKind::bad_input,
                 std::to_string(view.bounds.size()) + " marks of saturated pixels for " +
                     std::to_string(view.image.rgb.size() / 3) + " pixels",
                 view.name, "Give a mark for each pixel, or none at all"};
  }
  EMBERLOCK_RETURN_IF_ERROR(check_pixels(view.image, "pixel", view.name));
  const auto check_beside = [&](const auto& picture, const char* name) -> Status {
    if (!picture) return {};
    if (picture->size != size || picture->rgb.size() != view.image.rgb.size()) {
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

/// `judged(pixel, channel, a - b)` is what counts of a difference.
template <class Judged>
std::array<double, 3> rmse_over(const RadianceImage& a, const RadianceImage& b, const PixelBox& box,
                                const Judged& judged) {
  const PixelBox all = box.empty() ? PixelBox{0, 0, a.size.width, a.size.height} : box;
  std::array<double, 3> sum = {};
  for (int y = all.y0; y < all.y1; ++y) {
    for (int x = all.x0; x < all.x1; ++x) {
      const std::size_t p =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(a.size.width) + static_cast<std::size_t>(x);
      for (std::size_t c = 0; c < 3; ++c) {
        const double d =
            judged(p, c, static_cast<double>(a.rgb[3 * p + c]) - static_cast<double>(b.rgb[3 * p + c]));
        sum[c] += d * d;
      }
    }
  }
  const double pixels =
      std::max(1.0, static_cast<double>(all.x1 - all.x0) * static_cast<double>(all.y1 - all.y0));
  for (double& s : sum) s = std::sqrt(s / pixels);
  return sum;
}

}  // namespace

double noise_threshold(const RadianceImage& image) {
  constexpr int kBlocks = 12;  // along the shorter side, where pixels allow
  const int edge = std::clamp(std::min(image.size.width, image.size.height) / kBlocks, 4, 16);
  std::vector<double> means;
  std::vector<double> peaks;
  for (int y = 0; y + edge <= image.size.height; y += edge) {
    for (int x = 0; x + edge <= image.size.width; x += edge) {
      double sum = 0;
      double peak = -std::numeric_limits<double>::infinity();
      for (int i = 0; i < edge * edge; ++i) {
        const std::size_t p =
            static_cast<std::size_t>(y + i / edge) * static_cast<std::size_t>(image.size.width) +
            static_cast<std::size_t>(x + i % edge);
        const auto v = static_cast<double>(brightness(&image.rgb[3 * p]));
        sum += v;
        peak = std::max(peak, v);
      }
      means.push_back(sum / (edge * edge));
      peaks.push_back(peak);
    }
  }
  if (means.empty()) return 1;
  // The brightest of n normal pixels lies about sqrt(2 ln n) - 1/2 sigma above their mean. Looking at the
  // brightest ones needs no model of what clipping at black, quantisation and demosaicing do to the rest.
  const double background = median(means);
  const double above = std::sqrt(2 * std::log(edge * edge)) - 0.5;
  return background + std::max(1.0, 6 / above * (median(peaks) - background));
}

FlameMask flame_mask(const RadianceImage& image, double threshold) {
  FlameMask mask;
  mask.size = image.size;
  mask.threshold = threshold;
  mask.flame.resize(image.rgb.size() / 3);
  PixelBox box{image.size.width, image.size.height, 0, 0};
  for (int y = 0; y < image.size.height; ++y) {
    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.size.width);
    for (int x = 0; x < image.size.width; ++x) {
      const std::size_t p = row + static_cast<std::size_t>(x);
      if (!(brightness(&image.rgb[3 * p]) > threshold)) continue;
      mask.flame[p] = 1;
      box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
    }
  }
  mask.box = box.empty() ? PixelBox{} : box;
  return mask;
}

FlameMask noise_mask(const RadianceImage& image) {
  const FlameMask raw = flame_mask(image, noise_threshold(image));
  constexpr int kNeighbours = 3;
  const auto lit = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < raw.size.width && y < raw.size.height && raw.at(x, y);
  };
  FlameMask mask{raw.size, raw.threshold, std::vector<std::uint8_t>(raw.flame.size()), {}};
  PixelBox box{raw.size.width, raw.size.height, 0, 0};
  for (int y = raw.box.y0; y < raw.box.y1; ++y) {
    for (int x = raw.box.x0; x < raw.box.x1; ++x) {
      if (!raw.at(x, y)) continue;
      int around = -1;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) around += lit(x + dx, y + dy) ? 1 : 0;
      if (around < kNeighbours) continue;
      mask.flame[static_cast<std::size_t>(y) * static_cast<std::size_t>(raw.size.width) +
                 static_cast<std::size_t>(x)] = 1;
      box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
    }
  }
  mask.box = box.empty() ? PixelBox{} : box;
  return mask;
}

std::vector<FlameMask> flame_masks(const Scene& scene, std::optional<double> threshold) {
  std::vector<FlameMask> masks;
  masks.reserve(scene.views.size());
  for (const View& view : scene.views)
    masks.push_back(threshold ? flame_mask(view.image, *threshold) : noise_mask(view.image));
  return masks;
}

namespace {

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

std::array<double, 3> rmse(const RadianceImage& a, const RadianceImage& b, const PixelBox& box) {
  return rmse_over(a, b, box, [](std::size_t, std::size_t, double d) { return d; });
}

std::array<double, 3> rmse(const View& view, const RadianceImage& rendered, const PixelBox& box) {
  if (view.bounds.empty()) return rmse(view.image, rendered, box);
  return rmse_over(view.image, rendered, box, [&](std::size_t pixel, std::size_t c, double d) {
    return d < 0 && (view.bounds[pixel] >> c & 1) != 0 ? 0.0 : d;
  });
}

double all_channels(const std::array<double, 3>& rmse) {
  return std::sqrt((rmse[0] * rmse[0] + rmse[1] * rmse[1] + rmse[2] * rmse[2]) / 3);
}

}  // namespace emberlock::recon
