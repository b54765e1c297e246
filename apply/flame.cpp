// SPDX-License-Identifier: Apache-2.0
#include "apply/flame.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "recon/kernels/in_scatter.h"
#include "recon/kernels/march.h"
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

recon::ShiningGrid shining(const recon::CoarseMedium& medium) {
  return {medium.grid.nx, medium.grid.ny, medium.grid.nz, medium.shine.data()};
}

recon::Rgba at_place(const recon::ShiningGrid& grid, const Eigen::Vector3d& p) {
  return grid.at(static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]));
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
      medium_(recon::filled_voxels(volume_)),
      crop_(recon::crop_to_medium(medium_)) {
  for (float& e : volume_.emission) e *= static_cast<float>(brightness);
  if (!volume_.extinction.empty()) {
    effects_.extinction.model = recon::Extinction::Model::field;
    effects_.scattering = lighting_.scattering;
  }
  source_ = recon::cropped_source(volume_, crop_, effects_.extinction.model);
  if (effects_.scattering.order != recon::Scattering::Order::none && effects_.scattering.albedo > 0)
    scattered_ = recon::find_in_scatter(volume_, medium_, effects_, {}, pool);
  coarse_ = recon::coarse_medium(volume_, medium_, for_surfaces(volume_), light_voxels, pool);
}

Flame::View Flame::seen_by(const recon::CameraModel& camera, double step, recon::Pool& pool) const {
  // A projection doesn't change with the scale of what is before the camera, nor with its handedness.
  recon::CameraModel beside = camera;
  const recon::Rigid3& from_world = camera.camera_from_world;
  beside.camera_from_world = {from_world.rotation * world_from_flame_.rotation,
                              from_world * world_from_flame_.translation / world_from_flame_.scale};
  View view;
  const ImageSize size = camera.intrinsics.size;
  view.ray_of_pixel.assign(static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height), -1);
  if (medium_.count == 0) return view;
  if (!scattered_.empty()) {
    view.source = source_;
    recon::add_in_scatter(scattered_, beside.center(), crop_.hull.grid, effects_.extinction, pool,
                          view.source);
  }
  recon::RayListOptions options;
  options.step = static_cast<float>(step);
  options.boxes = {pixels_around(beside, crop_.hull.grid)};
  view.rays = recon::clip_rays({&beside}, crop_.hull, options, pool);
  for (std::size_t r = 0; r < view.rays.pixels.size(); ++r)
    view.ray_of_pixel[view.rays.pixels[r]] = static_cast<std::int32_t>(r);
  return view;
}

void Flame::add_steps(const View& view, std::size_t pixel, RayLight& light) const {
  const std::int32_t ray = view.ray_of_pixel[pixel];
  if (ray < 0) return;
  const recon::RayTable table = view.rays.table();
  const recon::MarchRay& r = table.rays[ray];
  const float meters = crop_.hull.grid.edge * static_cast<float>(world_from_flame_.scale);
  const float per_meter = 1 / meters;
  const auto row = static_cast<std::size_t>(table.nx);
  const std::size_t plane = row * static_cast<std::size_t>(table.ny);
  const recon::Rgba* source = source_of(view);
  std::vector<RayLight::Step>& steps = light.steps();
  for (std::size_t n = r.first_run; n < r.first_run + r.runs; ++n) {
    const recon::Run& run = table.runs[n];
    float reached = run.start * meters;
    auto put = [&](int sample, std::int32_t base, float fx, float fy, float fz) {
      const float to = (run.start + static_cast<float>(sample + 1) * run.step) * meters;
      steps.push_back({reached, to, per_meter * recon::trilinear(source + base, row, plane, fx, fy, fz)});
      reached = to;
    };
    recon::each_sample<float>(table, recon::StraightPath::line<float>(table, n), run, put);
  }
  light.end_flame();
}

std::vector<recon::Rgba> Flame::marched(View& view, const std::vector<float>& until,
                                        recon::Pool& pool) const {
  recon::RayList& list = view.rays;
  std::vector<recon::Rgba> seen(list.rays.size());
  const double edge = static_cast<double>(crop_.hull.grid.edge) * world_from_flame_.scale;
  recon::MarchWork<float> work;
  work.rays = list.table();
  work.volume = source_of(view);
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

Eigen::Vector3d Flame::in_coarse_edges(const Eigen::Vector3d& world) const {
  const recon::Grid& g = coarse_.grid;
  return (flame_from_world_ * world - Eigen::Vector3f(g.origin[0], g.origin[1], g.origin[2]).cast<double>()) /
         static_cast<double>(g.edge);
}

std::pair<double, double> Flame::inside(const Eigen::Vector3d& from, const Eigen::Vector3d& along) const {
  const double last[3] = {coarse_.grid.nx - 1.0, coarse_.grid.ny - 1.0, coarse_.grid.nz - 1.0};
  double enters = -std::numeric_limits<double>::infinity();
  double leaves = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    if (along[a] == 0) {
      if (from[a] < 0 || from[a] > last[a]) return {1, 0};
      continue;
    }
    const double low = -from[a] / along[a];
    const double high = (last[a] - from[a]) / along[a];
    enters = std::max(enters, std::min(low, high));
    leaves = std::min(leaves, std::max(low, high));
  }
  return {enters, leaves};
}

double Flame::close_by(const Eigen::Vector3d& place) const {
  if (medium_.count == 0) return 0;
  const Eigen::Vector3d p = in_coarse_edges(place);
  const Eigen::Vector3d last(coarse_.grid.nx - 1, coarse_.grid.ny - 1, coarse_.grid.nz - 1);
  constexpr double kMargin = 2;
  if ((p.array() < -kMargin).any() || (p.array() > last.array() + kMargin).any()) return 0;
  return light_edge();
}

double Flame::depth_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
  if (volume_.extinction.empty() || medium_.count == 0) return 0;
  const Eigen::Vector3d from = in_coarse_edges(a);
  const Eigen::Vector3d along = in_coarse_edges(b) - from;
  const std::pair<double, double> part = inside(from, along);
  const double enters = std::max(part.first, 0.0);
  const double leaves = std::min(part.second, 1.0);
  if (!(leaves > enters)) return 0;
  const double length = (leaves - enters) * along.norm();
  const int steps = std::max(1, static_cast<int>(std::ceil(length)));
  const recon::ShiningGrid grid = shining(coarse_);
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double t = enters + (i + 0.5) / steps * (leaves - enters);
    sum += static_cast<double>(at_place(grid, from + t * along).c[3]);
  }
  return sum * length / steps;
}

void Flame::add_coarse_steps(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double a,
                             RayLight& light) const {
  if (medium_.count == 0) return;
  const Eigen::Vector3d from = in_coarse_edges(origin);
  const Eigen::Vector3d along = in_coarse_edges(origin + direction) - from;  // of one metre
  const std::pair<double, double> part = inside(from, along);
  const double enters = std::max(part.first, 0.0);
  if (!(part.second > enters)) return;
  const double edges = along.norm();
  const int steps = std::max(1, static_cast<int>(std::ceil((part.second - enters) * edges)));
  const double step = (part.second - enters) / steps;
  const recon::ShiningGrid grid = shining(coarse_);
  for (int i = 0; i < steps; ++i) {
    const double t = enters + (i + 0.5) * step;
    const recon::Rgba shine = static_cast<float>(edges) * at_place(grid, from + t * along);
    recon::Rgba share = static_cast<float>(a > 0 ? a * a / (t * t + a * a) : 0) * shine;
    share.c[3] = shine.c[3];
    light.steps().push_back(
        {static_cast<float>(enters + i * step), static_cast<float>(enters + (i + 1) * step), share});
  }
  light.end_flame();
}

std::vector<Flame::Emitter> Flame::emitters() const {
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

Flame::Sent Flame::sent(std::uint32_t voxel, const Eigen::Vector3d& within) const {
  const recon::Grid& g = coarse_.grid;
  const auto nx = static_cast<std::uint32_t>(g.nx);
  const auto ny = static_cast<std::uint32_t>(g.ny);
  const Eigen::Vector3d corner(voxel % nx, voxel / nx % ny,
                               voxel / nx / ny);  // NOLINT(bugprone-integer-division)
  const Eigen::Vector3d origin(static_cast<double>(g.origin[0]), static_cast<double>(g.origin[1]),
                               static_cast<double>(g.origin[2]));
  const double edge = static_cast<double>(g.edge);
  const recon::Rgba shine =
      shining(coarse_).inside(coarse_.shine.data() + voxel, static_cast<float>(within[0]),
                              static_cast<float>(within[1]), static_cast<float>(within[2]));
  const double area = edge * edge * world_from_flame_.scale * world_from_flame_.scale;
  return {world_from_flame_ * (origin + edge * (corner + within)),
          area * Eigen::Vector3f(shine.c[0], shine.c[1], shine.c[2]).cast<double>()};
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
