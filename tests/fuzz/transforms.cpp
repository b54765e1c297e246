// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/transforms.h"

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "tests/fuzz/target.h"

/// Whatever a transforms.json holds: an error, or cameras that are finite and rigid.
FUZZ_TARGET(transforms) {
  using namespace emberlock;
  const auto transforms =
      recon::parse_transforms({reinterpret_cast<const char*>(data), size}, "fuzz/transforms.json");
  if (!transforms) {
    if (transforms.error().where.empty() || transforms.error().remedy.empty()) std::abort();
    return 0;
  }
  for (const recon::TransformsFrame& frame : transforms->frames) {
    const auto lens = recon::intrinsics_of(frame, {frame.lens.w.value_or(64), frame.lens.h.value_or(48)});
    if (!lens) continue;
    const recon::CameraModel camera{*lens, frame.camera_from_world};
    const recon::Ray ray = camera.ray({0.5, 0.5});
    if (!ray.origin.allFinite() || !(std::abs(ray.direction.norm() - 1) < 1e-9)) std::abort();
  }
  return 0;
}
