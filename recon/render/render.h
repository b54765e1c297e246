// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/compute/device.h"
#include "recon/effects/effects.h"
#include "recon/effects/refraction.h"
#include "recon/hull/hull.h"
#include "recon/render/in_scatter.h"
#include "recon/render/volume.h"
#include "recon/views/view.h"

namespace emberlock::recon {

// The model, front to back along the ray through a pixel's centre (radiative transport, the paper's section
// "Rendering Model", equations (5) and (6), blended as in (7) and (8)):
//   L += T S ds phi(sigma ds),  T *= exp(-sigma ds),  phi(x) = (1 - exp(-x)) / x,  phi(0) = 1
// S is the volume's emission in grey levels per metre, trilinear between key points. sigma is
// Effects::extinction, constant or a field inside the medium (the hull's voxels), and 0 outside, so T counts
// only the path inside. Every interval inside the medium is divided into equal steps of at most one voxel
// edge, with S taken at their middles. The paper's opacity tau per step of one edge is sigma = -ln(1 - tau) /
// edge. If the medium scatters (Effects::scattering), albedo * sigma * G is added to S, with G from
// in_scatter.h towards the camera.

// The other effects are passes around the march, which exist only if they are on: the volume averaged over
// the exposure, rays bent by the gas, the background behind the transmittance, the sensor's response.

struct RenderOptions {
  double step = 1;  ///< maximum step, in voxel edges, > 0
  ComputeOptions compute;
  /// For Background::Kind::image: the picture behind the flame, of the camera's size; null: black.
  const RadianceImage* background = nullptr;
  /// For refraction: the gas temperature, if it is known better than by assume_temperature().
  const GasTemperature* gas = nullptr;
  InScatterOptions in_scatter = {};
  /// For scattering: the result of find_in_scatter, to be shared by several views of a volume; null: computed
  /// for each.
  const ScatterField* scattered = nullptr;
};

/// Renders a camera's view of the volume inside the medium, in grey levels: linear and not clipped unless the
/// sensor's effects are on. `effects` must pass `check`. Throws a DeviceError if options.compute.device isn't
/// usable.
RadianceImage render_view(const Volume& volume, const Hull& medium, const Effects& effects,
                          const CameraModel& camera, const RenderOptions& options = {});

/// The same for several cameras, in their order: what the volume takes to be prepared, or brought to a GPU,
/// is taken once. `backgrounds`, one a camera, stand for the options'.
std::vector<RadianceImage> render_views(const Volume& volume, const Hull& medium, const Effects& effects,
                                        const std::vector<const CameraModel*>& cameras,
                                        const std::vector<const RadianceImage*>& backgrounds,
                                        const RenderOptions& options = {});

}  // namespace emberlock::recon
