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

namespace {

/// The values of every n-th pixel, so many that a median is good.
template <class Value>
std::vector<float> sample(const RadianceImage& image, const Value& value) {
  const std::size_t pixels = image.rgb.size() / 3;
  const std::size_t step = 1 + pixels / 100000;
  std::vector<float> values;
  for (std::size_t p = 0; p < pixels; p += step) values.push_back(value(p));
  return values;
}

/// One channel's background plus six sigma, from the spread of the pixels below the background's median,
/// which no flame touches. A picture clipped at black has none.
double threshold_from_below(const RadianceImage& image, std::size_t channel) {
  std::vector<float> levels = sample(image, [&](std::size_t p) { return image.rgb[3 * p + channel]; });
  const double middle = median(levels);
  std::erase_if(levels, [&](float v) { return static_cast<double>(v) > middle; });
  const double background = median(levels);
  double squares = 0;
  double count = 0;
  for (const float v : levels) {
    const double below = background - static_cast<double>(v);
    if (below <= 0) continue;
    squares += below * below;
    ++count;
  }
  // Of a normal distribution's lower quarter the RMS distance to the quartile is 0.773 sigma.
  const double sigma = count > 0 ? std::sqrt(squares / count) / 0.773 : 0;
  return background + 6 * sigma;
}

/// The background's brightest channel plus five sigma, from the differences of neighbours. A demosaiced
/// picture's neighbours share their noise: it has too little of them.
double threshold_from_differences(const RadianceImage& image) {
  const auto at = [&](std::size_t p) { return brightness(&image.rgb[3 * p]); };
  std::vector<float> levels = sample(image, at);
  const double middle = median(levels);
  std::erase_if(levels, [&](float v) { return static_cast<double>(v) > middle; });
  const double background = median(levels);
  const std::size_t last = image.rgb.size() / 3 - 1;
  std::vector<float> steps = sample(image, [&](std::size_t p) {
    const float a = at(p);
    const float b = at(std::min(p + 1, last));
    return static_cast<double>(std::max(a, b)) <= middle ? std::abs(a - b) : -1.0F;
  });
  std::erase_if(steps, [](float v) { return v < 0; });
  // Median absolute difference of two normal variables: sqrt(2) * 0.6745 sigma.
  return background + std::max(1.0, 5 * median(steps) / 0.9539);
}

}  // namespace

double noise_threshold(const RadianceImage& image) {
  if (image.rgb.empty()) return 1;
  double threshold = threshold_from_differences(image);
  for (std::size_t c = 0; c < 3; ++c) threshold = std::max(threshold, threshold_from_below(image, c));
  return threshold;
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
