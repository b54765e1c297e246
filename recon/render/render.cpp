#include "recon/render/render.h"

#include <algorithm>

#include "recon/compute/pool.h"
#include "recon/hull/ray_list.h"
#include "recon/kernels/march.h"

namespace emberlock {
namespace {

/// Emission a voxel edge at the cropped grid's key points.
std::vector<Rgba> crop_emission(const Volume& volume, const CroppedHull& crop) {
  const Grid& c = crop.hull.grid;
  std::vector<Rgba> out(c.size());
  for (int k = 0; k < c.nz; ++k) {
    for (int j = 0; j < c.ny; ++j) {
      const float* from =
          &volume.emission[3 * volume.grid.index(crop.offset[0], crop.offset[1] + j, crop.offset[2] + k)];
      Rgba* to = &out[c.index(0, j, k)];
      for (int i = 0; i < c.nx; ++i, from += 3) to[i] = c.edge * Rgba{{from[0], from[1], from[2], 0}};
    }
  }
  return out;
}

template <class Extinction>
void render_rays(const RayList& list, const std::vector<Rgba>& emission, const Extinction& extinction,
                 Pool& pool, RadianceImage& image) {
  const Forward<Extinction> forward{list.table(), emission.data(), extinction};
  constexpr int kTasks = 128;
  pool.run(kTasks, [&](int task) {
    const Slice rays = slice(list.rays.size(), kTasks, task);
    for (std::size_t r = rays.begin; r < rays.end; ++r) {
      const Rgba radiance = forward(r);
      std::copy_n(radiance.c, 3, &image.rgb[3 * static_cast<std::size_t>(list.pixels[r])]);
    }
  });
}

}  // namespace

RadianceImage render_view(const Volume& volume, const Hull& medium, const Effects& effects,
                          const CameraModel& camera, const RenderOptions& options) {
  RadianceImage image(camera.intrinsics.size);
  if (medium.count == 0) return image;
  Pool pool(options.compute.threads);
  const CroppedHull crop = crop_to_medium(medium);
  RayListOptions clip;
  clip.step = static_cast<float>(options.step);
  const RayList list = clip_rays({&camera}, crop.hull, clip, pool);
  const std::vector<Rgba> emission = crop_emission(volume, crop);
  const auto sigma =
      static_cast<float>(effects.extinction.value.value() * static_cast<double>(volume.grid.edge));
  if (sigma > 0)
    render_rays(list, emission, ConstantExtinction{sigma}, pool, image);
  else
    render_rays(list, emission, NoExtinction{}, pool, image);
  return image;
}

}  // namespace emberlock
