#pragma once

#include "recon/synthetic/flame.h"

namespace emberlock {

/// The paper's set-up at a size for tests: eleven pictures of 160 x 120, the truth on 64 voxels.
inline Scene small_flame_scene(PerMeter extinction = PerMeter(32.8), FlameShape shape = FlameShape::plume) {
  PaperSceneOptions options;
  options.flame.shape = shape;
  options.flame.extinction = extinction;
  options.image = {160, 120};
  options.truth_voxels = 64;
  return paper_scene(options);
}

}  // namespace emberlock
