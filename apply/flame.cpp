// SPDX-License-Identifier: Apache-2.0
#include "apply/flame.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "recon/kernels/in_scatter.h"
#include "recon/render/cropped_source.h"
#include "recon/render/march_table.h"
#include "recon/render/scattered_source.h"

namespace emberlock::apply {
namespace {

/// Without extinction the coarse grid has emission alone.
recon::Extinction for_surfaces(const recon::Volume& volume) {
  recon::Extinction extinction;
  extinction.model =
      volume.extinction.empty() ? recon::Extinction::Model::constant : recon::Extinction::Model::field;
  return extinction;
}

Affine affine(const Eigen::Matrix3d& linear, const Eigen::Vector3d& offset) {
  Affine to;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) to.m[4 * r + c] = static_cast<float>(linear(r, c));
    to.m[4 * r + 3] = static_cast<float>(offset[r]);
  }
  return to;
}

/// The pixels that may see a grid's box: those around its edges, which a lens bends; all of them where a part
/// of it isn't before the camera, or lies where the lens may fold its picture over.
recon::PixelBox pixels_around(const recon::CameraModel& camera, const recon::Grid& grid) {
  const ImageSize size = camera.intrinsics.size;
  const recon::PixelBox all{0, 0, size.width, size.height};
  constexpr int kAlong = 8;
  constexpr double kMargin = 4;  // pixels that an edge may bend between two of its places
  const recon::Box box = recon::box_of(grid);
  double widest = 0;  // tangent of the angle from the axis, squared
  for (int corner = 0; corner < 4; ++corner) {
    const Eigen::Vector2d pixel((corner & 1) * size.width, (corner >> 1) * size.height);
    const Eigen::Vector3d ray = recon::CameraModel{camera.intrinsics, {}}.ray(pixel).direction;
    widest = std::max(widest, ray.head<2>().squaredNorm() / (ray.z() * ray.z()));
  }
  Eigen::AlignedBox2d seen;
  for (int edge = 0; edge < 12; ++edge)
    for (int i = 0; i <= kAlong; ++i) {
      const int axis = edge / 4;
      Eigen::Vector3d side;
      side[axis] = static_cast<double>(i) / kAlong - 0.5;
      side[(axis + 1) % 3] = (edge & 1) - 0.5;
      side[(axis + 2) % 3] = (edge >> 1 & 1) - 0.5;
      const Eigen::Vector3d place = box.center + side.cwiseProduct(box.size);
      const Eigen::Vector3d there = camera.camera_from_world * place;
      if (!(there.z() > 1e-3 * static_cast<double>(grid.edge))) return all;
      if (!camera.intrinsics.distortion.none() &&
          there.head<2>().squaredNorm() > widest * there.z() * there.z())
        return all;
      seen.extend(camera.project(place));
    }
  const auto bound = [](double v, int limit) {
    return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(limit)));
  };
  return {bound(seen.min().x() - kMargin, size.width), bound(seen.min().y() - kMargin, size.height),
          bound(seen.max().x() + kMargin, size.width), bound(seen.max().y() + kMargin, size.height)};
}

/// Ends a ray's runs at a distance, voxel edges.
void end_ray(recon::RayList& list, std::size_t ray, float until) {
  recon::MarchRay& r = list.rays[ray];
  for (std::uint32_t n = 0; n < r.runs; ++n) {
    recon::Run& run = list.runs[r.first_run + n];
    if (run.start + static_cast<float>(run.count) * run.step <= until) continue;
    const float left = until - run.start;
    r.runs = left > 0 ? n + 1 : n;
    if (left > 0) {
      run.count = std::max(1, static_cast<int>(std::ceil(left / run.step)));
      run.step = left / static_cast<float>(run.count);
    }
    return;
  }
}

}  // namespace

Flame::Flame(recon::ShownVolume shown, const Placement& world_from_flame, double brightness, int light_voxels,
             recon::Pool& pool)
    : volume_(std::move(shown.volume)),
      lighting_(shown.lighting),
      world_from_flame_(world_from_flame),
      flame_from_world_(world_from_flame.inverse()),
      light_voxels_(light_voxels),
      medium_(recon::filled_voxels(volume_)),
      crop_(recon::crop_to_medium(medium_)) {
  for (float& e : volume_.emission) e *= static_cast<float>(brightness);
  if (!volume_.extinction.empty()) {
    effects_.extinction.model = recon::Extinction::Model::field;
    effects_.scattering = lighting_.scattering;
  }
  source_ = std::make_shared<const std::vector<recon::Rgba>>(
      recon::cropped_source(volume_, crop_, effects_.extinction.model));
  if (scatters()) scattered_ = recon::find_in_scatter(volume_, medium_, effects_, {}, pool);
  coarse_ = recon::coarse_medium(volume_, medium_, for_surfaces(volume_), light_voxels, pool);
  emitters_ = glowing();
}

Flame::View Flame::seen_by(const recon::CameraModel& camera, double step, recon::Pool& pool) const {
  // A projection doesn't change with the scale of what is before the camera, nor with its handedness.
  recon::CameraModel beside = camera;
  const recon::Rigid3& from_world = camera.camera_from_world;
  beside.camera_from_world = {from_world.rotation * world_from_flame_.rotation,
                              from_world * world_from_flame_.translation / world_from_flame_.scale};
  View view;
  view.source = source_;
  const bool here = pool.device() != recon::Device::cuda;
  const ImageSize size = camera.intrinsics.size;
  if (here)
    view.ray_of_pixel.assign(static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height),
                             -1);
  if (medium_.count == 0) return view;
  if (!scattered_.empty() || !beam_.empty()) {
    std::vector<recon::Rgba> source = *source_;
    if (!scattered_.empty())
      recon::add_in_scatter(scattered_, beside.center(), crop_.hull.grid, effects_.extinction, pool, source);
    if (!beam_.empty()) add_beam(beside.center(), source, pool);
    view.source = std::make_shared<const std::vector<recon::Rgba>>(std::move(source));
  }
  recon::RayListOptions options;
  options.step = static_cast<float>(step);
  options.boxes = {pixels_around(beside, crop_.hull.grid)};
  if (!here) options.home = recon::RayListOptions::Home::where_it_is_made;
  view.rays = recon::clip_rays({&beside}, crop_.hull, options, pool);
  for (std::size_t r = 0; here && r < view.rays.pixels.size(); ++r)
    view.ray_of_pixel[view.rays.pixels[r]] = static_cast<std::int32_t>(r);
  return view;
}

std::vector<recon::Rgba> Flame::marched(View& view, const std::vector<float>& until,
                                        recon::Pool& pool) const {
  recon::RayList& list = view.rays;
  std::vector<recon::Rgba> seen(list.rays.size());
  const double edge = static_cast<double>(crop_.hull.grid.edge) * world_from_flame_.scale;
  recon::MarchWork<float> work;
  work.rays = list.table();
  work.volume = view.source->data();
  work.residual = seen.data();
  const auto absorb = effects_.extinction.model == recon::Extinction::Model::field ? recon::Absorb::field
                                                                                   : recon::Absorb::nothing;
  const auto forward = recon::march_table<float>().forward_of(absorb, recon::Travel::straight);
  constexpr int kTasks = 64;
  pool.run(kTasks, [&](int task) {
    const recon::Slice mine = recon::slice(list.rays.size(), kTasks, task);
    for (std::size_t r = mine.begin; r < mine.end; ++r)
      end_ray(list, r, static_cast<float>(static_cast<double>(until[list.pixels[r]]) / edge));
    forward(work, mine.begin, mine.end);
  });
  return seen;
}

FlameTable Flame::table() const {
  FlameTable table;
  const recon::Grid& g = coarse_.grid;
  table.there = medium_.count > 0;
  table.absorbs = !volume_.extinction.empty();
  table.edge_meters = crop_.hull.grid.edge * static_cast<float>(world_from_flame_.scale);
  table.coarse = {g.nx, g.ny, g.nz, coarse_.shine.data()};
  table.coarse_meters = g.edge * static_cast<float>(world_from_flame_.scale);
  const Eigen::Vector3d origin(static_cast<double>(g.origin[0]), static_cast<double>(g.origin[1]),
                               static_cast<double>(g.origin[2]));
  const auto edge = static_cast<double>(g.edge);
  table.world_from_coarse =
      affine(edge * world_from_flame_.scale * world_from_flame_.rotation, world_from_flame_ * origin);
  table.coarse_from_world = affine(flame_from_world_.scale / edge * flame_from_world_.rotation,
                                   (flame_from_world_.translation - origin) / edge);
  return table;
}

FlameTable Flame::table(const View& view) const {
  FlameTable table = this->table();
  table.rays = view.rays.table();
  table.source = view.source->data();
  table.ray_of_pixel = view.ray_of_pixel.data();
  return table;
}

std::vector<Flame::Emitter> Flame::glowing() const {
  std::vector<Emitter> all;
  if (medium_.count == 0) return all;
  const recon::Grid& g = coarse_.grid;
  const double edge = light_edge();
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j)
      for (int i = 0; i < g.nx - 1; ++i) {
        double sum = 0;
        for (int c = 0; c < 8; ++c) {
          const recon::Rgba& s = coarse_.shine[g.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))];
          sum += static_cast<double>(s.c[0] + s.c[1] + s.c[2]);
        }
        if (sum > 0) all.push_back({static_cast<std::uint32_t>(g.index(i, j, k)), sum / 24 * edge * edge});
      }
  return all;
}

Eigen::AlignedBox3d Flame::bounds() const {
  const recon::Box box = recon::box_of(volume_.grid);
  Eigen::AlignedBox3d around;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d side((corner & 1) - 0.5, (corner >> 1 & 1) - 0.5, (corner >> 2) - 0.5);
    around.extend(world_from_flame_ * (box.center + side.cwiseProduct(box.size)));
  }
  return around;
}

}  // namespace emberlock::apply
