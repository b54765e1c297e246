// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "apply/flame.h"
#include "apply/surfaces.h"
#include "recon/compute/pool.h"
#include "recon/effects/effects.h"
#include "recon/views/camera_model.h"
#include "recon/views/radiance_image.h"

namespace emberlock::apply {

// The picture of flames among surfaces. Through each pixel's centre all flames are marched at once
// (kernels/merged_light.h); samples through places within the pixel meet surfaces at distances z and shine by
//   L = L_flames(z) + T_flames(z) (emitted + albedo (E / pi + outside))
// with one random sample of the irradiance E of flames and of surfaces that glow each
// (kernels/surface_light.h), and the light from outside as it falls there (light_tables.h). So flames have no
// noise: without surfaces a picture is that of render_view(), and what isn't exact then is the difference
// between the light of a flame at a pixel's centre and its mean over the pixel, as there.
//
// Smoke scatters the light from outside (Flame::light_by()), in which surfaces and other smoke shade it, and
// what it scatters falls on surfaces.
//
// Not simulated: light from surface to surface, light that surfaces emit onto smoke, a flame's in-scatter
// onto surfaces (it is shown to cameras), light of one flame scattered by another's smoke, shade in the light
// from all sides, mirrors, glass, rays bent by hot gas, the shutter's time.

/// What stands around flames.
struct Surroundings {
  const Surfaces& surfaces;
  recon::Light light = {};                ///< LightTables'
  std::array<double, 3> background = {};  ///< grey levels
};

struct PictureOptions {
  int samples = 16;        ///< of each pixel, 1..65536; where nothing but flames is seen, one
  double step = 1;         ///< of the march, at most, in voxel edges, > 0
  std::uint64_t seed = 1;  ///< of the random numbers: another one for each frame
};

struct ScenePicture {
  recon::RadianceImage light;  ///< grey levels, linear
  std::vector<float> opacity;  ///< 0..1: the share of the background that doesn't come through
  /// Of each pixel, grey levels: the standard error of the mean of its channels, from the variance of its
  /// samples; 0 where there is no noise, and everywhere with one sample, which tells none.
  std::vector<float> error;
};

/// The same for any number of threads.
ScenePicture scene_picture(const std::vector<const Flame*>& flames, const Surroundings& around,
                           const recon::CameraModel& camera, const PictureOptions& options,
                           recon::Pool& pool);

/// Root of the mean square of a picture's errors, grey levels. It falls with the root of the samples: four
/// times as many halve it.
double rms_error(const ScenePicture& picture);

}  // namespace emberlock::apply
