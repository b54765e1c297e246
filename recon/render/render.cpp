#include "recon/render/render.h"

#include <algorithm>

#include "recon/compute/pool.h"
#include "recon/hull/ray_list.h"
#include "recon/render/march_table.h"

namespace emberlock {
namespace {

/// Emission, and in lane 3 extinction where it is a field, a voxel edge, at the cropped grid's key points.
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
  const std::vector<Rgba> source = crop_volume(volume, crop, effects.extinction.model);
  std::vector<Rgba> seen(list.rays.size());
  MarchWork<float> work;
  work.rays = list.table();
  work.volume = source.data();
  work.sigma = static_cast<float>(effects.extinction.value.value() * static_cast<double>(volume.grid.edge));
  work.residual = seen.data();
  const auto march = march_table<float>().forward_of(absorb_of(effects.extinction.model), Travel::straight);
  constexpr int kTasks = 128;
  pool.run(kTasks, [&](int task) {
    const Slice rays = slice(seen.size(), kTasks, task);
    march(work, rays.begin, rays.end);
    for (std::size_t r = rays.begin; r < rays.end; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        image.rgb[3 * static_cast<std::size_t>(list.pixels[r]) + c] = seen[r].c[c];
  });
  return image;
}

}  // namespace emberlock
