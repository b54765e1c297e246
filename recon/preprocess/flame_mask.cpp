#include "recon/preprocess/flame_mask.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace emberlock {
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
  const auto bad =
      std::find_if(view.image.rgb.begin(), view.image.rgb.end(), [](float v) { return !std::isfinite(v); });
  if (bad != view.image.rgb.end()) {
    const auto pixel = (bad - view.image.rgb.begin()) / 3;
    return Error{ErrorKind::bad_input,
                 "pixel (" + std::to_string(pixel % size.width) + ", " + std::to_string(pixel / size.width) +
                     ") is not a finite number",
                 view.name, "Replace this frame, or leave the view out"};
  }
  return {};
}

}  // namespace

double noise_threshold(const RadianceImage& image) {
  const auto width = static_cast<std::size_t>(image.size.width);
  const auto height = static_cast<std::size_t>(image.size.height);
  if (width * height == 0) return 1;
  // Every pixel is not needed for a median: rows are skipped until some 100 000 are left.
  const std::size_t row_step = 1 + width * height / 100000;
  std::vector<float> levels;
  for (std::size_t y = 0; y < height; y += row_step)
    for (std::size_t x = 0; x < width; ++x) levels.push_back(brightness(&image.rgb[3 * (y * width + x)]));
  const double middle = median(levels);
  std::vector<float> dark;
  for (const float v : levels)
    if (v <= middle) dark.push_back(v);
  const double background = median(dark);
  std::vector<float> steps;
  for (std::size_t y = 0; y < height; y += row_step) {
    for (std::size_t x = 1; x < width; ++x) {
      const float a = brightness(&image.rgb[3 * (y * width + x - 1)]);
      const float b = brightness(&image.rgb[3 * (y * width + x)]);
      if (a <= middle && b <= middle) steps.push_back(std::abs(a - b));
    }
  }
  // Median absolute difference of two normal variables: sqrt(2) * 0.6745 sigma.
  const double sigma = median(steps) / 0.9539;
  return background + std::max(1.0, 5 * sigma);
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

std::vector<FlameMask> flame_masks(const Scene& scene, std::optional<double> threshold) {
  std::vector<FlameMask> masks;
  masks.reserve(scene.views.size());
  for (const View& view : scene.views)
    masks.push_back(flame_mask(view.image, threshold ? *threshold : noise_threshold(view.image)));
  return masks;
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
  return {};
}

std::array<double, 3> rmse(const RadianceImage& a, const RadianceImage& b, const PixelBox& box) {
  const PixelBox all = box.empty() ? PixelBox{0, 0, a.size.width, a.size.height} : box;
  std::array<double, 3> sum = {};
  for (int y = all.y0; y < all.y1; ++y) {
    for (int x = all.x0; x < all.x1; ++x) {
      const std::size_t p = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(a.size.width) +
                                 static_cast<std::size_t>(x));
      for (std::size_t c = 0; c < 3; ++c) {
        const double d = static_cast<double>(a.rgb[p + c]) - static_cast<double>(b.rgb[p + c]);
        sum[c] += d * d;
      }
    }
  }
  const double pixels =
      std::max(1.0, static_cast<double>(all.x1 - all.x0) * static_cast<double>(all.y1 - all.y0));
  for (double& s : sum) s = std::sqrt(s / pixels);
  return sum;
}

double all_channels(const std::array<double, 3>& rmse) {
  return std::sqrt((rmse[0] * rmse[0] + rmse[1] * rmse[1] + rmse[2] * rmse[2]) / 3);
}

}  // namespace emberlock
