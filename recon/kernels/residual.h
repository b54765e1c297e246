// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "recon/kernels/rgba.h"

namespace emberlock::recon {

/// What a ray's radiance is held against. A background, an offset and a sensor's white are each there or not,
/// for all rays.
template <class Real>
struct PixelResidual {
  const Rgba* seen =
      nullptr;  ///< captured radiance, one a ray; lane 3: View::bounds, looked at where white > 0
  const Rgba* background = nullptr;  ///< radiance behind the medium, one a ray
  const Rgba* offset = nullptr;  ///< added to the rendered radiance: what another pass has found, one a ray
  Real white = 0;  ///< captured values from here on are bounds: more light explains them; 0: none are;
                   ///< infinite: those that lane 3 of `seen` marks

  /// The residual in lanes 0..2 and its product with the background in lane 3, from radiance and
  /// transmittance.
  HOST_DEVICE Quad<Real> operator()(std::size_t ray, const Quad<Real>& radiance) const {
    Quad<Real> residual;
    for (int c = 0; c < 3; ++c) residual.c[c] = radiance.c[c] - Real(seen[ray].c[c]);
    if (background != nullptr)
      for (int c = 0; c < 3; ++c) residual.c[c] += radiance.c[3] * Real(background[ray].c[c]);
    if (offset != nullptr)
      for (int c = 0; c < 3; ++c) residual.c[c] += Real(offset[ray].c[c]);
    if (white > 0)
      for (int c = 0; c < 3; ++c)
        if (residual.c[c] > 0 && (Real(seen[ray].c[c]) >= white || is_bound(ray, c))) residual.c[c] = 0;
    if (background != nullptr)
      for (int c = 0; c < 3; ++c) residual.c[3] += residual.c[c] * Real(background[ray].c[c]);
    return residual;
  }

 private:
  [[nodiscard]] HOST_DEVICE bool is_bound(std::size_t ray, int channel) const {
    return (static_cast<int>(seen[ray].c[3]) >> channel & 1) != 0;
  }
};

/// The same, and the ray keeps it.
template <class Real>
struct KeepResidual {
  PixelResidual<Real> pixel;
  Quad<Real>* residual = nullptr;  ///< one a ray

  HOST_DEVICE Quad<Real> operator()(std::size_t ray, const Quad<Real>& radiance) const {
    return residual[ray] = pixel(ray, radiance);
  }
};

/// Term of a sum (sum.h): a ray's squared residuals for R, G and B, with its weight where there are any.
template <class Real>
struct SquareTerm {
  const Quad<Real>* residual = nullptr;  ///< one a ray
  const float* weight = nullptr;         ///< one a ray, or none

  HOST_DEVICE Quad<double> operator()(std::size_t ray) const {
    const double w = weight == nullptr ? 1 : static_cast<double>(weight[ray]);
    Quad<double> sum;
    for (int c = 0; c < 3; ++c)
      sum.c[c] = w * static_cast<double>(residual[ray].c[c]) * static_cast<double>(residual[ray].c[c]);
    return sum;
  }
};

/// The ray keeps what was marched.
template <class Real>
struct KeepRadiance {
  Quad<Real>* radiance = nullptr;  ///< one a ray

  HOST_DEVICE void operator()(std::size_t ray, const Quad<Real>& marched) const { radiance[ray] = marched; }
};

/// A march of one ray and what becomes of its radiance.
template <class March, class Keep>
struct MarchAndKeep {
  March march;
  Keep keep;

  HOST_DEVICE void operator()(std::size_t ray) const { keep(ray, march(ray)); }
};
/// The same for marches that need it themselves.
template <class March, class Keep>
struct MarchByResidual {
  March march;
  Keep keep;

  HOST_DEVICE void operator()(std::size_t ray) const { march(ray, keep); }
};

}  // namespace emberlock::recon
