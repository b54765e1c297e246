// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/synthetic/flame.h"

namespace emberlock {

/// The paper's set-up at a size for tests.
inline recon::PaperSceneOptions small_film(ImageSize image = {160, 120}, int truth_voxels = 64) {
  recon::PaperSceneOptions options;
  options.image = image;
  options.truth_voxels = truth_voxels;
  return options;
}

/// Eleven pictures of 160 x 120, the truth on 64 voxels.
inline recon::Scene small_flame_scene(PerMeter extinction = PerMeter(32.8),
                                      recon::FlameShape shape = recon::FlameShape::plume) {
  recon::PaperSceneOptions options = small_film();
  options.flame.shape = shape;
  options.flame.extinction = extinction;
  return recon::paper_scene(options);
}

}  // namespace emberlock
