// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "base/host_device.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

/// One key point of an average along z: out(k) = sum of weight(m) * in(k - m) over m = -reach..reach, with
/// zeros outside the grid. With `direction` -1 it reads in(k + m): the transpose.
template <class Real>
struct AverageAlongZ {
  const Quad<Real>* in = nullptr;
  Quad<Real>* out = nullptr;
  std::size_t plane = 0;  ///< key points per layer
  int nz = 0;
  const float* weights = nullptr;  ///< 2 * reach + 1 values, from m = -reach on
  int reach = 0;
  int direction = 1;

  HOST_DEVICE void operator()(std::size_t in_layer, int k) const {
    Quad<Real> sum;
    for (int m = -reach; m <= reach; ++m) {
      const int from = k - direction * m;
      if (from < 0 || from >= nz) continue;
      sum = sum + Real(weights[m + reach]) * in[in_layer + plane * static_cast<std::size_t>(from)];
    }
    out[in_layer + plane * static_cast<std::size_t>(k)] = sum;
  }
  /// At the key point of an index.
  HOST_DEVICE void operator()(std::size_t p) const { (*this)(p % plane, static_cast<int>(p / plane)); }
};

template <class Real>
struct AddAt {
  const Quad<Real>* from = nullptr;
  Quad<Real>* to = nullptr;

  HOST_DEVICE void operator()(std::size_t p) const { to[p] = to[p] + from[p]; }
};

}  // namespace emberlock::recon
