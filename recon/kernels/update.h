#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/rgba.h"

namespace emberlock {

/// The default solver's step at one key point: a gradient step with its own length, projection on x >= 0,
/// Nesterov's look-ahead.
///   x' = max(0, y - (scale * gradient + smoothing * laplacian(y)) / (weight + 12 smoothing)),  y' = x' +
///   momentum * (x' - x)
/// weight = A^T A 1 majorises A^T A (A >= 0), 12 the Laplacian's largest eigenvalue. The gradient is cleared
/// for the next subset.
struct Descend {
  int nx = 2, ny = 2, nz = 2;
  const float* weight = nullptr;  ///< 0 where no ray comes: such key points stay at 0
  Rgba* x = nullptr;
  const Rgba* y = nullptr;
  Rgba* next_y = nullptr;
  Rgba* gradient = nullptr;
  float scale = 1;
  float smoothing = 0;
  float momentum = 0;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t row = static_cast<std::size_t>(nx);
    const std::size_t plane = row * static_cast<std::size_t>(ny);
    const std::size_t p =
        static_cast<std::size_t>(i) + row * static_cast<std::size_t>(j) + plane * static_cast<std::size_t>(k);
    const Rgba g = gradient[p];
    gradient[p] = Rgba{};
    if (weight[p] <= 0) return;
    Rgba around;
    if (i > 0) around = around + y[p - 1];
    if (i < nx - 1) around = around + y[p + 1];
    if (j > 0) around = around + y[p - row];
    if (j < ny - 1) around = around + y[p + row];
    if (k > 0) around = around + y[p - plane];
    if (k < nz - 1) around = around + y[p + plane];
    const Rgba slope = scale * g + smoothing * (6.F * y[p] - around);
    const Rgba after = non_negative(y[p] - (1 / (weight[p] + 12 * smoothing)) * slope);
    next_y[p] = after + momentum * (after - x[p]);
    x[p] = after;
  }
};

}  // namespace emberlock
