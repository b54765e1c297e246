#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/rgba.h"

namespace emberlock {

/// The default solver's step at one key point, for lanes 0..2 (lane 3 stays as it is): a gradient step with
/// its own length, projection on x >= 0, Nesterov's look-ahead.
///   x' = max(0, y - (scale * gradient + smoothing * laplacian(y)) / (weight + 12 smoothing)),  y' = x' +
///   momentum * (x' - x)
/// weight = A^T A 1 majorises A^T A (A >= 0), 12 the Laplacian's largest eigenvalue. The gradient is cleared
/// for the next subset.
template <class Real>
struct Descend {
  int nx = 2, ny = 2, nz = 2;
  const Real* weight = nullptr;  ///< 0 where no ray comes: such key points stay at 0
  Quad<Real>* x = nullptr;
  const Quad<Real>* y = nullptr;
  Quad<Real>* next_y = nullptr;
  Quad<Real>* gradient = nullptr;
  Real scale = 1;
  Real smoothing = 0;
  Real momentum = 0;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t row = static_cast<std::size_t>(nx);
    const std::size_t plane = row * static_cast<std::size_t>(ny);
    const std::size_t p =
        static_cast<std::size_t>(i) + row * static_cast<std::size_t>(j) + plane * static_cast<std::size_t>(k);
    const Quad<Real> g = gradient[p];
    gradient[p] = Quad<Real>{};
    if (weight[p] <= 0) return;
    const Quad<Real> here = y[p];
    Quad<Real> slope = scale * g + smoothing * laplacian(i, j, k, p, row, plane);
    slope.c[3] = 0;
    const Quad<Real> after = non_negative(here - (1 / (weight[p] + 12 * smoothing)) * slope);
    next_y[p] = after + momentum * (after - x[p]);
    x[p] = after;
  }

 private:
  /// 6 y minus its neighbours; what lies outside the grid is 0.
  HOST_DEVICE Quad<Real> laplacian(int i, int j, int k, std::size_t p, std::size_t row,
                                   std::size_t plane) const {
    Quad<Real> around;
    if (i > 0) around = around + y[p - 1];
    if (i < nx - 1) around = around + y[p + 1];
    if (j > 0) around = around + y[p - row];
    if (j < ny - 1) around = around + y[p + row];
    if (k > 0) around = around + y[p - plane];
    if (k < nz - 1) around = around + y[p + plane];
    return Real(6) * y[p] - around;
  }
};

}  // namespace emberlock
