// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/compute/device.h"
#include "recon/effects/effects.h"
#include "recon/effects/refraction.h"
#include "recon/hull/hull.h"
#include "recon/preprocess/view.h"
#include "recon/render/in_scatter.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

// The model, front to back along the ray through a pixel's centre (Radiative Transport, the paper's section
// "Rendering Model", equations (5) and (6), blended as by (7) and (8)):
//   L += T S ds phi(sigma ds),  T *= exp(-sigma ds),  phi(x) = (1 - exp(-x)) / x,  phi(0) = 1
// S is the volume's emission in grey levels per metre, trilinear between key points; sigma is
// Effects::extinction, constant or a field inside the medium (the hull's voxels) and 0 outside, so T counts
// only what lies inside. Every stretch inside the medium is cut into equal steps of at most one voxel edge
// and S is taken at their middles. The paper's opacity tau a step of one edge is sigma = -ln(1 - tau) / edge.
// Where the medium scatters (Effects::scattering), S has albedo * sigma * G on top, G of in_scatter.h towards
// the camera.

// The other effects are passes around the march, each there only where it is on: the volume averaged over the
// exposure, rays bent by the gas, the background that the transmittance lets through, the sensor's response.

struct RenderOptions {
  double step = 1;  ///< the longest step, in voxel edges, > 0
  ComputeOptions compute;
  /// Background::Kind::image: what lies behind the flame, of the camera's size; black where null.
  const RadianceImage* background = nullptr;
  /// Refraction: the gas, where it is known better than assume_temperature() has it.
  const GasTemperature* gas = nullptr;
  InScatterOptions in_scatter = {};
  /// Scattering: find_in_scatter's result, for several views of one volume; each finds its own where null.
  const ScatterField* scattered = nullptr;
};

/// What a camera sees of the volume inside the medium, in grey levels: linear and not clipped unless the
/// sensor's effects are on. `effects` must pass `check`. Throws a DeviceError where options.compute.device
/// can't run.
RadianceImage render_view(const Volume& volume, const Hull& medium, const Effects& effects,
                          const CameraModel& camera, const RenderOptions& options = {});

}  // namespace emberlock::recon
