#pragma once

#include "base/host_device.h"
#include "recon/kernels/rgba.h"

namespace emberlock {

/// L += T B: a ray's radiance with its transmittance in lane 3, before a background.
HOST_DEVICE inline Rgba before(const Rgba& background, const Rgba& rendered) {
  Rgba seen = rendered + rendered.c[3] * background;
  seen.c[3] = rendered.c[3];
  return seen;
}

}  // namespace emberlock
