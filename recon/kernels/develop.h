// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"

namespace emberlock::recon {

// From a sensor's samples to radiance, a thread a sample, a pixel or a column (recon/preprocess/develop.h).

/// The layout of a frame's samples: one per pixel (grey, or an RGGB mosaic) or three.
enum class SampleLayout { grey, mosaic, rgb };

/// How the colours that a mosaic didn't measure are interpolated. Both methods are linear in the samples, and
/// keep measured ones.
enum class Demosaicing {
  bilinear,  ///< better for flames: they are smooth, and it amplifies noise least
  /// Malvar, He and Cutler 2004: bilinear plus the Laplacian of the measured colour, 5 x 5 samples; bilinear
  /// near the border and where one of the 25 samples is saturated. Better for pictures with sharp edges.
  gradient,
};

/// Channel (0 R, 1 G, 2 B) that an RGGB mosaic measures at a pixel.
HOST_DEVICE inline constexpr int mosaic_channel(int x, int y) { return (x & 1) + (y & 1); }

/// A frame's samples where they lie.
struct SampleView {
  const float* value = nullptr;             ///< [(y * width + x) * channels() + c]
  const std::uint8_t* saturated = nullptr;  ///< one a sample, 1 or 0; null: none is
  int width = 0, height = 0;
  SampleLayout layout = SampleLayout::grey;

  [[nodiscard]] HOST_DEVICE inline int channels() const { return layout == SampleLayout::rgb ? 3 : 1; }
  /// Distance between samples of the same colour.
  [[nodiscard]] HOST_DEVICE inline int pitch() const { return layout == SampleLayout::mosaic ? 2 : 1; }
  [[nodiscard]] HOST_DEVICE inline std::size_t index(int x, int y, int c = 0) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels()) +
           static_cast<std::size_t>(c);
  }
  [[nodiscard]] HOST_DEVICE inline bool bound(std::size_t at) const {
    return saturated != nullptr && saturated[at] != 0;
  }
};

/// The light of a sensor's numbers: by the response, minus the dark level.
struct LightOfNumber {
  const float* of_number = nullptr;  ///< grey levels, of every number up to white
  int white = 255;
  float dark[3] = {};
  SampleLayout layout = SampleLayout::grey;

  [[nodiscard]] HOST_DEVICE inline float at(int number, int x, int y, int c) const {
    const int channel = layout == SampleLayout::grey     ? 1
                        : layout == SampleLayout::mosaic ? mosaic_channel(x, y)
                                                         : c;
    return of_number[number < white ? number : white] - dark[channel];
  }
};

struct LightOfSample {
  const void* sensor = nullptr;  ///< rows without gaps
  bool wide = false;             ///< two bytes a sample, not one
  LightOfNumber light;
  SampleView to;  ///< its layout
  float* value = nullptr;
  std::uint8_t* saturated = nullptr;

  HOST_DEVICE inline void operator()(std::size_t at) const {
    const auto channels = static_cast<std::size_t>(to.channels());
    const auto width = static_cast<std::size_t>(to.width);
    const std::size_t pixel = at / channels;
    const int number =
        wide ? static_cast<const std::uint16_t*>(sensor)[at] : static_cast<const std::uint8_t*>(sensor)[at];
    value[at] = light.at(number, static_cast<int>(pixel % width), static_cast<int>(pixel / width),
                         static_cast<int>(at % channels));
    saturated[at] = number < light.white ? 0 : 1;
  }
};

/// A sample's neighbours of the same colour, up to eight.
struct Neighbours {
  float value[8] = {};
  std::size_t at[8] = {};
  int count = 0;

  HOST_DEVICE inline void add(float v, std::size_t index) {
    value[count] = v;
    at[count++] = index;
  }
  /// Sorts the values, not the indices.
  HOST_DEVICE inline void sort() {
    for (int i = 1; i < count; ++i)
      for (int k = i; k > 0 && value[k] < value[k - 1]; --k) {
        const float v = value[k];
        value[k] = value[k - 1];
        value[k - 1] = v;
      }
  }
  [[nodiscard]] HOST_DEVICE inline float median() {
    if (count == 0) return 0;
    sort();
    return 0.5F * (value[(count - 1) / 2] + value[count / 2]);
  }
};

/// Some pixels of a picture, y * width + x, ascending.
struct PixelList {
  const std::uint32_t* pixels = nullptr;
  std::size_t count = 0;

  [[nodiscard]] HOST_DEVICE inline bool holds(std::uint32_t pixel) const {
    std::size_t first = 0;
    for (std::size_t left = count; left > 0;) {
      const std::size_t half = left / 2;
      const bool before = pixels[first + half] < pixel;
      first = before ? first + half + 1 : first;
      left = before ? left - half - 1 : half;
    }
    return first < count && pixels[first] == pixel;
  }
};

/// In a mosaic they are two pixels away, also for green, so that all colours are treated alike. Those of the
/// list are left out.
HOST_DEVICE inline Neighbours neighbours_of(const SampleView& s, int x, int y, int c,
                                            const PixelList& without = {}) {
  Neighbours out;
  const int pitch = s.pitch();
  for (int v = y - pitch; v <= y + pitch; v += pitch) {
    for (int u = x - pitch; u <= x + pitch; u += pitch) {
      const bool inside = u >= 0 && v >= 0 && u < s.width && v < s.height;
      if (!inside || (u == x && v == y) || without.holds(static_cast<std::uint32_t>(v * s.width + u)))
        continue;
      out.add(s.value[s.index(u, v, c)], s.index(u, v, c));
    }
  }
  return out;
}

/// A hot pixel becomes its neighbours' median: of those that aren't hot, so that threads don't meet.
struct ReplaceHotPixel {
  SampleView s;
  PixelList hot;
  float* value = nullptr;             ///< the view's
  std::uint8_t* saturated = nullptr;  ///< the view's, or null

  HOST_DEVICE inline void operator()(std::size_t at) const {
    const int x = static_cast<int>(hot.pixels[at]) % s.width;
    const int y = static_cast<int>(hot.pixels[at]) / s.width;
    for (int c = 0; c < s.channels(); ++c) {
      Neighbours around = neighbours_of(s, x, y, c, hot);
      if (around.count == 0) continue;
      if (saturated != nullptr) {
        int bounds = 0;
        for (int i = 0; i < around.count; ++i) bounds += saturated[around.at[i]];
        saturated[s.index(x, y, c)] = 2 * bounds > around.count ? 1 : 0;
      }
      value[s.index(x, y, c)] = around.median();
    }
  }
};

/// What every row has too much of, by its samples.
struct TakeFromSample {
  float* value = nullptr;
  const float* less = nullptr;  ///< `period` of them, again and again
  std::size_t period = 1;

  HOST_DEVICE inline void operator()(std::size_t at) const { value[at] -= less[at % period]; }
};

/// Row by row in the direction in which light has been picked up: all of it is known by then. A thread a
/// column.
struct TakeSmearOfRows {
  SampleView s;
  float* value = nullptr;  ///< the view's
  bool from_top = true;
  double fraction[3] = {};

  HOST_DEVICE inline void operator()(std::size_t x) const {
    double light = 0;
    for (int i = 0; i < s.height; ++i) {
      const int y = from_top ? i : s.height - 1 - i;
      const double before = light;
      for (int c = 0; c < s.channels(); ++c) {
        float& here = value[s.index(static_cast<int>(x), y, c)];
        here -= static_cast<float>(fraction[c] * before);
        light += static_cast<double>(here) / s.channels();
      }
    }
  }
};

/// Red, green and blue of a pixel, and bits 1, 2 and 4 for those that are bounds.
struct DemosaicPixel {
  SampleView s;
  Demosaicing how = Demosaicing::bilinear;
  float* rgb = nullptr;            ///< 3 a pixel
  std::uint8_t* bounds = nullptr;  ///< one a pixel; null: nobody asks

  /// A normalised convolution with (1 2 1) x (1 2 1) over the samples of one channel: the usual weights
  /// inside, and at the border they are distributed over the existing neighbours.
  [[nodiscard]] HOST_DEVICE inline float bilinear(int x, int y, int channel, bool& bound) const {
    float sum = 0;
    int weights = 0;
    for (int v = y > 0 ? y - 1 : 0; v <= y + 1 && v < s.height; ++v) {
      for (int u = x > 0 ? x - 1 : 0; u <= x + 1 && u < s.width; ++u) {
        if (mosaic_channel(u, v) != channel) continue;
        const int weight = (u == x ? 2 : 1) * (v == y ? 2 : 1);
        sum += static_cast<float>(weight) * s.value[s.index(u, v)];
        weights += weight;
        bound = bound || s.bound(s.index(u, v));
      }
    }
    return weights == 0 ? 0.0F : sum / static_cast<float>(weights);
  }

  /// The filters of Malvar, He and Cutler 2004, figure 2, times 16, by rows of 5 x 5.
  [[nodiscard]] HOST_DEVICE inline float filtered(int x, int y, int channel) const {
    // clang-format off
    constexpr float kFilters[4][25] = {
        // green at red and blue
        {0, 0, -2, 0, 0,   0, 0, 4, 0, 0,    -2, 4, 8, 4, -2,    0, 0, 4, 0, 0,    0, 0, -2, 0, 0},
        // red at blue, blue at red
        {0, 0, -3, 0, 0,   0, 4, 0, 4, 0,    -3, 0, 12, 0, -3,   0, 4, 0, 4, 0,    0, 0, -3, 0, 0},
        // red or blue at green, its neighbours left and right
        {0, 0, 1, 0, 0,    0, -2, 0, -2, 0,  -2, 8, 10, 8, -2,   0, -2, 0, -2, 0,  0, 0, 1, 0, 0},
        // its neighbours above and below
        {0, 0, -2, 0, 0,   0, -2, 8, -2, 0,  1, 0, 10, 0, 1,     0, -2, 8, -2, 0,  0, 0, -2, 0, 0}};
    // clang-format on
    const int filter = channel == 1                          ? 0
                       : mosaic_channel(x, y) != 1           ? 1
                       : mosaic_channel(x + 1, y) == channel ? 2
                                                             : 3;
    float sum = 0;
    const float* row = s.value + s.index(x - 2, y - 2);
    for (int v = 0; v < 5; ++v, row += s.width)
      for (int u = 0; u < 5; ++u) sum += kFilters[filter][5 * v + u] * row[u];
    return sum / 16;
  }
  [[nodiscard]] HOST_DEVICE inline bool any_bound_near(int x, int y) const {
    if (s.saturated == nullptr) return false;
    for (int v = y - 2; v <= y + 2; ++v)
      for (int u = x - 2; u <= x + 2; ++u)
        if (s.bound(s.index(u, v))) return true;
    return false;
  }

  HOST_DEVICE inline void at(int x, int y) const {
    const std::size_t pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(s.width) + static_cast<std::size_t>(x);
    const bool mosaic = s.layout == SampleLayout::mosaic;
    const bool inside = x >= 2 && y >= 2 && x + 2 < s.width && y + 2 < s.height;
    const bool gradient = mosaic && how == Demosaicing::gradient && inside && !any_bound_near(x, y);
    unsigned bits = 0;
    for (int c = 0; c < 3; ++c) {
      const std::size_t own = s.index(x, y, s.layout == SampleLayout::rgb ? c : 0);
      bool bound = false;
      float& to = rgb[3 * pixel + static_cast<std::size_t>(c)];
      if (!mosaic || c == mosaic_channel(x, y)) {
        to = s.value[own];
        bound = s.bound(own);
      } else {
        to = gradient ? filtered(x, y, c) : bilinear(x, y, c, bound);
      }
      if (bound) bits |= 1U << c;
    }
    if (bounds != nullptr) bounds[pixel] = static_cast<std::uint8_t>(bits);
  }
  HOST_DEVICE inline void operator()(std::size_t pixel) const {
    const auto width = static_cast<std::size_t>(s.width);
    at(static_cast<int>(pixel % width), static_cast<int>(pixel / width));
  }
};

/// A lens's light, 1 in the middle: 1 + k2 r^2 + k4 r^4 + k6 r^6, with `r_squared` in half diagonals.
HOST_DEVICE inline double falloff(const double* k, double r_squared) {
  return 1 + r_squared * (k[0] + r_squared * (k[1] + r_squared * k[2]));
}
/// Squared distance of a point (pixel centres at +0.5) from the picture's middle, in half diagonals.
HOST_DEVICE inline double radius_squared(int width, int height, double x, double y) {
  const double dx = x - 0.5 * width;
  const double dy = y - 0.5 * height;
  return 4 * (dx * dx + dy * dy) /
         (static_cast<double>(width) * width + static_cast<double>(height) * height);
}

/// Values at the middles of cells that divide a picture evenly, linear between them, and beyond them as they
/// are at the outermost.
struct CellsOfLight {
  int columns = 0, rows = 0;
  const float* light = nullptr;  ///< [3 * (row * columns + column) + channel]; null: 1 everywhere

  struct Between {
    int before, after;
    double part;
  };
  [[nodiscard]] HOST_DEVICE static inline Between between(double share, int cells) {
    const double wanted = share * cells - 0.5;
    const double last = cells - 1;
    const double place = wanted < 0 ? 0 : wanted < last ? wanted : last;
    const int before = static_cast<int>(place);
    return {before, before + 1 < cells ? before + 1 : before, place - before};
  }
  /// At x and y in 0..1 of the picture's sides.
  HOST_DEVICE inline void at(double x, double y, double* to) const {
    for (int c = 0; c < 3; ++c) to[c] = 1;
    if (light == nullptr) return;
    const Between across = between(x, columns);
    const Between down = between(y, rows);
    for (int c = 0; c < 3; ++c) {
      const double above = (1 - across.part) * cell(across.before, down.before, c) +
                           across.part * cell(across.after, down.before, c);
      const double below = (1 - across.part) * cell(across.before, down.after, c) +
                           across.part * cell(across.after, down.after, c);
      to[c] = (1 - down.part) * above + down.part * below;
    }
  }

 private:
  [[nodiscard]] HOST_DEVICE inline double cell(int column, int row, int c) const {
    return static_cast<double>(light[3 * (row * columns + column) + c]);
  }
};

/// Takes a level away, then applies gain, vignetting and flat field.
struct EqualisePixel {
  float* rgb = nullptr;  ///< 3 a pixel
  int width = 0, height = 0;
  float level[3] = {};
  bool even = false;  ///< nothing but the level
  double gain[3] = {1, 1, 1};
  double vignetting[3] = {};
  CellsOfLight flat = {};

  [[nodiscard]] bool changes_nothing() const {
    return even && level[0] == 0 && level[1] == 0 && level[2] == 0;
  }
  HOST_DEVICE inline void at(int x, int y) const {
    float* p = rgb + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                          static_cast<std::size_t>(x));
    for (int c = 0; c < 3; ++c) p[c] -= level[c];
    if (even) return;
    const double lens = falloff(vignetting, radius_squared(width, height, x + 0.5, y + 0.5));
    double light[3];
    flat.at((x + 0.5) / width, (y + 0.5) / height, light);
    for (int c = 0; c < 3; ++c)
      p[c] = static_cast<float>(static_cast<double>(p[c]) * gain[c] / (lens * light[c]));
  }
  HOST_DEVICE inline void operator()(std::size_t pixel) const {
    const auto across = static_cast<std::size_t>(width);
    at(static_cast<int>(pixel % across), static_cast<int>(pixel / across));
  }
};

}  // namespace emberlock::recon
