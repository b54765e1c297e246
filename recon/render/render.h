#pragma once

#include "recon/compute/device.h"
#include "recon/effects/effects.h"
#include "recon/hull/hull.h"
#include "recon/preprocess/view.h"
#include "recon/render/volume.h"

namespace emberlock {

// The model, front to back along the ray through a pixel's centre (Radiative Transport, the paper's section
// "Rendering Model"):
//   L += T S ds phi(sigma ds),  T *= exp(-sigma ds),  phi(x) = (1 - exp(-x)) / x,  phi(0) = 1
// S is the volume's emission in grey levels per metre, trilinear between key points; sigma is
// Effects::extinction, constant or a field inside the medium (the hull's voxels) and 0 outside, so T counts only
// what lies inside. Every stretch inside the medium is cut into equal steps of at most one voxel edge and S is
// taken at their middles. The paper's opacity tau a step of one edge is sigma = -ln(1 - tau) / edge.

struct RenderOptions {
  double step = 1;  ///< the longest step, in voxel edges, > 0
  ComputeOptions compute;
};

/// What a camera sees of the volume inside the medium, before a black background; grey levels, not clipped at
/// 255.
RadianceImage render_view(const Volume& volume, const Hull& medium, const Effects& effects,
                          const CameraModel& camera, const RenderOptions& options = {});

}  // namespace emberlock
