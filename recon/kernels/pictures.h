// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/rays.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

/// The pixels of a view, and what lies behind its flame.
struct ViewPixels {
  const float* rgb = nullptr;            ///< 3 a pixel, row-major
  const std::uint8_t* bounds = nullptr;  ///< View::bounds, or null
  const float* behind = nullptr;         ///< 3 a pixel; null: the same everywhere
  float level[3] = {};                   ///< that
  int width = 0;

  [[nodiscard]] HOST_DEVICE inline Rgba seen(std::size_t pixel) const {
    const float bits = bounds != nullptr ? static_cast<float>(bounds[pixel]) : 0.F;
    return Rgba{{rgb[3 * pixel], rgb[3 * pixel + 1], rgb[3 * pixel + 2], bits}};
  }
  [[nodiscard]] HOST_DEVICE inline Rgba background(std::size_t pixel) const {
    if (behind == nullptr) return Rgba{{level[0], level[1], level[2], 0}};
    return Rgba{{behind[3 * pixel], behind[3 * pixel + 1], behind[3 * pixel + 2], 0}};
  }
  /// Squares of what the pixel shows beside its background, for R, G and B.
  [[nodiscard]] HOST_DEVICE inline Quad<double> squares(std::size_t pixel) const {
    const Rgba left = seen(pixel) - background(pixel);
    Quad<double> sum;
    for (int c = 0; c < 3; ++c) sum.c[c] = static_cast<double>(left.c[c]) * static_cast<double>(left.c[c]);
    return sum;
  }
};

/// What each ray's pixel shows, and what lies behind it.
struct ReadPixels {
  const ViewPixels* views = nullptr;
  const MarchRay* rays = nullptr;
  const std::uint32_t* pixels = nullptr;  ///< one a ray
  Rgba* seen = nullptr;
  Rgba* background = nullptr;  ///< null: nobody asks

  HOST_DEVICE inline void operator()(std::size_t ray) const {
    const ViewPixels& view = views[rays[ray].view];
    seen[ray] = view.seen(pixels[ray]);
    if (background != nullptr) background[ray] = view.background(pixels[ray]);
  }
};

/// The pixels [x0, x1) x [y0, y1) of a view that an error is taken over, and what each of them counts.
struct WeighedBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  float weight = 0;
};

/// What each ray counts: its box's weight, or nothing outside of it.
struct WeighRays {
  const ViewPixels* views = nullptr;
  const WeighedBox* boxes = nullptr;  ///< one a view
  const MarchRay* rays = nullptr;
  const std::uint32_t* pixels = nullptr;  ///< one a ray
  float* weights = nullptr;

  HOST_DEVICE inline void operator()(std::size_t ray) const {
    const WeighedBox& box = boxes[rays[ray].view];
    const auto width = static_cast<std::uint32_t>(views[rays[ray].view].width);
    const int x = static_cast<int>(pixels[ray] % width);
    const int y = static_cast<int>(pixels[ray] / width);
    const bool inside = x >= box.x0 && x < box.x1 && y >= box.y0 && y < box.y1;
    weights[ray] = inside ? box.weight : 0;
  }
};

// Terms of sums: Quad<double> of an element.

/// Of a ray: what its pixel shows beside its background, by what it counts.
struct BlackOfRay {
  const ViewPixels* views = nullptr;
  const MarchRay* rays = nullptr;
  const std::uint32_t* pixels = nullptr;
  const float* weights = nullptr;

  HOST_DEVICE inline Quad<double> operator()(std::size_t ray) const {
    return static_cast<double>(weights[ray]) * views[rays[ray].view].squares(pixels[ray]);
  }
};
/// Of one row of the views' boxes, `rows` for each view: the same over its pixels whose coordinates are
/// multiples of the stride.
struct BlackOfRow {
  const ViewPixels* views = nullptr;
  const WeighedBox* boxes = nullptr;
  std::size_t rows = 1;
  int stride = 1;

  HOST_DEVICE inline Quad<double> operator()(std::size_t at) const {
    const ViewPixels& view = views[at / rows];
    const WeighedBox& box = boxes[at / rows];
    const int y = box.y0 + static_cast<int>(at % rows);
    Quad<double> sum;
    if (y >= box.y1 || y % stride != 0) return sum;
    for (int x = (box.x0 + stride - 1) / stride * stride; x < box.x1; x += stride)
      sum = sum + view.squares(static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) +
                               static_cast<std::size_t>(x));
    return static_cast<double>(box.weight) * sum;
  }
};

}  // namespace emberlock::recon
