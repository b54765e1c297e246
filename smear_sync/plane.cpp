#include "smear_sync/plane.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace emberlock::detail {
namespace {

/// Sums of all 2 x 2 cells: each holds R + 2 G + B whatever its parity, so the mosaic leaves no pattern. A
/// cell with a saturated sample is white.
template <class Sample>
void sum_cells(const ImageView& view, Plane& plane) {
  const int white = view.layout.white();
  const int shift = sizeof(Sample) == 1 ? 0 : 2;  // four 16-bit samples don't fit 16 bits; their mean does
  plane.white = sizeof(Sample) == 1 ? 4.0 * white : white;
  plane.level = sizeof(Sample) == 1 ? 0.25 : 1;
  for (int y = 0; y < plane.size.height; ++y) {
    const Sample* a = view.row_as<Sample>(y);
    const Sample* b = view.row_as<Sample>(y + 1);
    std::uint16_t* out =
        plane.storage.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(plane.size.width);
    for (int x = 0; x < plane.size.width; ++x) {
      const int sum = a[x] + a[x + 1] + b[x] + b[x + 1];
      const bool clipped = std::max({a[x], a[x + 1], b[x], b[x + 1]}) >= white;
      out[x] = static_cast<std::uint16_t>(clipped ? static_cast<int>(plane.white) : sum >> shift);
    }
  }
}

template <class Sample>
void sum_channels(const ImageView& view, Plane& plane) {
  const int white = view.layout.white();
  const int divide = sizeof(Sample) == 1 ? 1 : 3;
  plane.white = sizeof(Sample) == 1 ? 3.0 * white : white;
  plane.level = sizeof(Sample) == 1 ? 1 / 3.0 : 1;
  for (int y = 0; y < plane.size.height; ++y) {
    const Sample* in = view.row_as<Sample>(y);
    std::uint16_t* out =
        plane.storage.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(plane.size.width);
    for (int x = 0; x < plane.size.width; ++x, in += 3) {
      const bool clipped = std::max({in[0], in[1], in[2]}) >= white;
      out[x] = static_cast<std::uint16_t>(clipped ? static_cast<int>(plane.white)
                                                  : (in[0] + in[1] + in[2]) / divide);
    }
  }
}

template <class Sample>
double peak_of(const Plane& plane) {
  Sample peak = 0;
  for (int y = 0; y < plane.size.height; ++y) {
    const Sample* row = plane.row<Sample>(y);
    for (int x = 0; x < plane.size.width; ++x) peak = std::max(peak, row[x]);
  }
  return peak;
}

double saturation_level(const Plane& plane, double peak) {
  constexpr double kNearly = 0.98;
  if (peak >= kNearly * plane.white || plane.white < 300) return kNearly * plane.white;
  const double plateau = 0.998 * peak;
  int count = 0;
  for (int y = 0; y < plane.size.height; ++y) {
    const std::uint16_t* row = plane.row<std::uint16_t>(y);
    for (int x = 0; x < plane.size.width; ++x) count += row[x] >= plateau ? 1 : 0;
  }
  return count >= 12 ? kNearly * peak : kNearly * plane.white;
}

}  // namespace

Plane to_plane(const ImageView& view) {
  Plane plane;
  plane.size = view.layout.size;
  plane.bytes = bytes_per_sample(view.layout.format);
  plane.data = view.data;
  plane.stride = view.stride;
  plane.white = view.layout.white();
  const bool bayer = is_bayer(view.layout.format);
  if (!bayer && channels(view.layout.format) == 1) return plane;
  if (bayer) {
    plane.size = {view.width() - 1, view.height() - 1};
    plane.offset = 0.5;
    plane.correlation = 2;
    if (plane.size.width < 1 || plane.size.height < 1) return plane.size = {}, plane;
  }
  plane.storage.resize(static_cast<std::size_t>(plane.size.width) *
                       static_cast<std::size_t>(plane.size.height));
  switch (view.layout.format) {
    case PixelFormat::bayer_rggb8:
      sum_cells<std::uint8_t>(view, plane);
      break;
    case PixelFormat::bayer_rggb16:
      sum_cells<std::uint16_t>(view, plane);
      break;
    case PixelFormat::rgb8:
      sum_channels<std::uint8_t>(view, plane);
      break;
    default:
      sum_channels<std::uint16_t>(view, plane);
      break;
  }
  plane.bytes = 2;
  plane.data = reinterpret_cast<const std::byte*>(plane.storage.data());
  plane.stride = static_cast<std::size_t>(plane.size.width) * 2;
  return plane;
}

Patch columns(const Plane& plane, int first, int last) {
  Patch patch;
  patch.x0 = std::clamp(first, 0, plane.size.width - 1);
  patch.width = std::clamp(last, patch.x0, plane.size.width - 1) - patch.x0 + 1;
  patch.height = plane.size.height;
  patch.v.resize(static_cast<std::size_t>(patch.width) * static_cast<std::size_t>(patch.height));
  for (int y = 0; y < patch.height; ++y) {
    float* out = patch.row(y);
    if (plane.bytes == 1) {
      std::copy_n(plane.row<std::uint8_t>(y) + patch.x0, patch.width, out);
    } else {
      std::copy_n(plane.row<std::uint16_t>(y) + patch.x0, patch.width, out);
    }
  }
  return patch;
}

Background measure_background(const Plane& plane) {
  // About 8000 pixels on a sheared grid tell level and noise to a percent.
  constexpr int kSamples = 8000;
  constexpr int kLag = 2;  // neighbours may share noise (cells of a mosaic, interpolated colour)
  const auto area = static_cast<double>(plane.size.width) * plane.size.height;
  const int step = std::max(1, static_cast<int>(std::sqrt(area / kSamples)));
  std::vector<float> values;
  std::vector<float> differences;
  std::size_t equal = 0;
  for (int y = step / 2; y < plane.size.height; y += step) {
    for (int x = (y * 7) % step; x < plane.size.width; x += step) {
      const float v = plane.at(x, y);
      values.push_back(v);
      if (x + kLag >= plane.size.width) continue;
      differences.push_back(std::abs(plane.at(x + kLag, y) - v));
      if (differences.back() == 0) ++equal;
    }
  }
  Background background;
  background.level = median(values);
  background.peak = plane.bytes == 1 ? peak_of<std::uint8_t>(plane) : peak_of<std::uint16_t>(plane);
  background.saturation = saturation_level(plane, background.peak);
  const double rough = std::max(0.5, robust_scale(differences));
  double sum = 0;
  std::size_t count = 0;
  for (const float d : differences) {
    if (d > 4 * rough) continue;
    sum += static_cast<double>(d) * d;
    ++count;
  }
  constexpr double kRounding = 0.2887;  // standard deviation of rounding to integers, 1 / sqrt(12)
  const double variance = count > 0 ? sum / static_cast<double>(2 * count) : 0;
  background.noise = std::max(kRounding, std::sqrt(variance));
  background.flat =
      !differences.empty() && static_cast<double>(equal) > 0.6 * static_cast<double>(differences.size());
  return background;
}

float median(std::span<float> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double clipped_mean(std::span<const float> values, double sigma) {
  // The centre only has to be good to a sigma: about 64 of the values tell it.
  const std::size_t step = std::max<std::size_t>(1, values.size() / 64);
  std::array<float, 128> few{};
  std::size_t n = 0;
  for (std::size_t i = step / 2; i < values.size() && n < few.size(); i += step) few[n++] = values[i];
  const float centre = median({few.data(), n});
  double sum = 0;
  int count = 0;
  for (const float v : values) {
    if (std::abs(v - centre) > 4 * sigma) continue;
    sum += v - centre;
    ++count;
  }
  return centre + (count > 0 ? sum / count : 0);
}

double robust_scale(std::span<float> values) {
  for (float& v : values) v = std::abs(v);
  return 1.4826 * median(values);
}

}  // namespace emberlock::detail
