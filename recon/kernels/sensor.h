#pragma once

#include <cmath>

#include "base/host_device.h"
#include "recon/kernels/rgba.h"

namespace emberlock {

// How a solver compares a ray's rendered radiance with what its pixel saw, both in linear grey levels. Lane 3
// of both is ignored and 0 in the residual.

/// Every pixel is a value: rendered - seen.
struct LinearResidual {
  HOST_DEVICE Rgba operator()(const Rgba& rendered, const Rgba& seen) const {
    Rgba residual = rendered - seen;
    residual.c[3] = 0;
    return residual;
  }
};

/// A saturated channel (seen >= white) bounds the radiance from below: no residual where the rendered one is
/// brighter than white. Half the square of this residual is convex in what is rendered, its gradient the
/// residual itself, and as steep at most as LinearResidual's, so that a solver's steps stay safe.
struct BoundedResidual {
  float white = 255;

  HOST_DEVICE Rgba operator()(const Rgba& rendered, const Rgba& seen) const {
    Rgba residual;
    for (int c = 0; c < 3; ++c) {
      const bool satisfied = seen.c[c] >= white && rendered.c[c] >= white;
      residual.c[c] = satisfied ? 0 : rendered.c[c] - fminf(seen.c[c], white);
    }
    return residual;
  }
};

}  // namespace emberlock
