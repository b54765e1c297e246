// SPDX-License-Identifier: Apache-2.0
#include "recon/render/render.h"

#include <algorithm>

#include "recon/compute/pool.h"
#include "recon/effects/background.h"
#include "recon/effects/exposure.h"
#include "recon/effects/sensor.h"
#include "recon/hull/ray_list.h"
#include "recon/render/march_table.h"
#include "recon/render/render_cuda.h"
#include "recon/render/scattered_source.h"

namespace emberlock::recon {
namespace {

/// Emission, and in lane 3 the extinction if it is a field, per voxel edge, at the cropped grid's key points.
std::vector<Rgba> crop_volume(const Volume& volume, const CroppedHull& crop, Extinction::Model extinction) {
  const Grid& c = crop.hull.grid;
  std::vector<Rgba> out(c.size());
  for (int k = 0; k < c.nz; ++k) {
    for (int j = 0; j < c.ny; ++j) {
      const std::size_t first = volume.grid.index(crop.offset[0], crop.offset[1] + j, crop.offset[2] + k);
      const float* from = &volume.emission[3 * first];
      Rgba* to = &out[c.index(0, j, k)];
      for (int i = 0; i < c.nx; ++i, from += 3) to[i] = c.edge * Rgba{{from[0], from[1], from[2], 0}};
      if (extinction == Extinction::Model::field)
        for (int i = 0; i < c.nx; ++i)
          to[i].c[3] = c.edge * volume.extinction[first + static_cast<std::size_t>(i)];
    }
  }
  return out;
}

constexpr Absorb absorb_of(Extinction::Model model) {
  switch (model) {
    case Extinction::Model::constant:
      return Absorb::constant;
    case Extinction::Model::field:
      return Absorb::field;
    case Extinction::Model::none:
      break;
  }
  return Absorb::nothing;
}

/// The rays of one camera, with the gas that bends them.
RayList rays_of(const CameraModel& camera, const Hull& medium, const std::vector<Rgba>& source,
                const Refraction& refraction, const RenderOptions& options, Pool& pool) {
  RayListOptions clip;
  clip.step = static_cast<float>(options.step);
  if (refraction.rays == Refraction::Rays::straight) return clip_rays({&camera}, medium, clip, pool);
  const RefractiveIndex index(
      options.gas != nullptr ? *options.gas : assume_temperature(medium, source, refraction),
      refraction.ambient);
  const IndexField gas = index.field(medium.grid);
  clip.gas = &gas;
  return clip_rays({&camera}, medium, clip, pool);
}

/// Puts the radiance and transmittance of rays in front of the image's present content.
void put_in_front(const Rgba* seen, const std::uint32_t* pixels, std::size_t count, RadianceImage& image) {
  for (std::size_t r = 0; r < count; ++r) {
    float* pixel = &image.rgb[3 * static_cast<std::size_t>(pixels[r])];
    for (int c = 0; c < 3; ++c) pixel[c] = seen[r].c[c] + seen[r].c[3] * pixel[c];
  }
}

void march(const RayList& list, const std::vector<Rgba>& source, Absorb absorb, float sigma, Pool& pool,
           RadianceImage& image) {
  if constexpr (kCudaBuilt) {
    if (pool.device() == Device::cuda) {
      const std::vector<Rgba> seen = march_on_cuda(list, source, absorb, sigma);
      return put_in_front(seen.data(), list.pixels.data(), seen.size(), image);
    }
  }
  std::vector<Rgba> seen(list.rays.size());
  MarchWork<float> work;
  work.rays = list.table();
  work.volume = source.data();
  work.sigma = sigma;
  work.residual = seen.data();
  const Travel travel = list.curved ? Travel::curved : Travel::straight;
  const auto forward = march_table<float>().forward_of(absorb, travel);
  constexpr int kTasks = 128;
  pool.run(kTasks, [&](int task) {
    const Slice rays = slice(list.rays.size(), kTasks, task);
    forward(work, rays.begin, rays.end);
    put_in_front(seen.data() + rays.begin, list.pixels.data() + rays.begin, rays.end - rays.begin, image);
  });
}

}  // namespace

RadianceImage render_view(const Volume& volume, const Hull& medium, const Effects& effects,
                          const CameraModel& camera, const RenderOptions& options) {
  RadianceImage image = backdrop(effects.background, camera.intrinsics.size, options.background);
  if (medium.count > 0) {
    Pool pool(options.compute);
    const CroppedHull crop = crop_to_medium(medium);
    std::vector<Rgba> source = crop_volume(volume, crop, effects.extinction.model);
    if (effects.scattering.order != Scattering::Order::none) {
      const ScatterField found = options.scattered != nullptr
                                     ? ScatterField{}
                                     : find_in_scatter(volume, medium, effects, options.in_scatter, pool);
      const ScatterField& field = options.scattered != nullptr ? *options.scattered : found;
      if (!field.empty())
        add_in_scatter(field, camera.center(), crop.hull.grid, effects.extinction, pool, source);
    }
    const ExposureBlur exposure(effects.exposure, crop.hull.grid);
    if (!exposure.identity()) source = exposure.forward(source, pool);
    const RayList list = rays_of(camera, crop.hull, source, effects.refraction, options, pool);
    const auto sigma =
        static_cast<float>(effects.extinction.value.value() * static_cast<double>(volume.grid.edge));
    march(list, source, absorb_of(effects.extinction.model), sigma, pool, image);
  }
  respond(image, effects.sensor);
  return image;
}

}  // namespace emberlock::recon
