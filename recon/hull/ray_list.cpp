// SPDX-License-Identifier: Apache-2.0
#include "recon/hull/ray_list.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>

#include <Eigen/LU>

#include "recon/hull/clip_bundle.h"
#include "recon/hull/hull.h"
#include "recon/hull/kernel_views.h"
#include "recon/hull/ray_list_cuda.h"
#include "recon/kernels/cut.h"
#include "recon/views/camera_model.h"

namespace emberlock::recon {
namespace {

std::size_t voxel_index(const Grid& g, int i, int j, int k) {
  return static_cast<std::size_t>(i) +
         static_cast<std::size_t>(g.nx - 1) *
             (static_cast<std::size_t>(j) + static_cast<std::size_t>(g.ny - 1) * static_cast<std::size_t>(k));
}

/// The pixels whose rays may hit the grid's box: the rectangle around its projected corners; or the whole
/// frame if the camera is so close that a corner lies behind it, or if distortion bends the box's edges
/// outwards.
PixelBox reach(const CameraModel& camera, const Grid& g) {
  const ImageSize size = camera.intrinsics.size;
  const PixelBox all{0, 0, size.width, size.height};
  if (!camera.intrinsics.distortion.none()) return all;
  Eigen::Vector2d low(1e30, 1e30);
  Eigen::Vector2d high(-1e30, -1e30);
  for (int corner = 0; corner < 8; ++corner) {
    const double edge = static_cast<double>(g.edge);
    const Eigen::Vector3d p(static_cast<double>(g.origin[0]) + (corner & 1) * (g.nx - 1) * edge,
                            static_cast<double>(g.origin[1]) + ((corner >> 1) & 1) * (g.ny - 1) * edge,
                            static_cast<double>(g.origin[2]) + (corner >> 2) * (g.nz - 1) * edge);
    if ((camera.camera_from_world * p).z() < 1e-3 * edge) return all;
    const Eigen::Vector2d pixel = camera.project(p);
    low = low.cwiseMin(pixel);
    high = high.cwiseMax(pixel);
  }
  const auto bound = [](double v, int limit) {
    return static_cast<int>(std::clamp(v, 0.0, static_cast<double>(limit)));
  };
  return {bound(std::floor(low.x()) - 1, size.width), bound(std::floor(low.y()) - 1, size.height),
          bound(std::ceil(high.x()) + 1, size.width), bound(std::ceil(high.y()) + 1, size.height)};
}

/// The part of a picture that may have rays.
PixelBox part_of(const std::vector<const CameraModel*>& cameras, std::size_t view, const Grid& grid,
                 const RayListOptions& options) {
  const PixelBox all = reach(*cameras[view], grid);
  if (options.boxes.empty()) return all;
  const PixelBox& box = options.boxes[view];
  return {std::max(all.x0, box.x0), std::max(all.y0, box.y0), std::min(all.x1, box.x1),
          std::min(all.y1, box.y1)};
}

struct PixelTile {
  std::uint32_t view;
  int x0, y0, x1, y1;
};

/// The rays of one tile of pixels; runs are counted from the first in the tile.
struct TileRays {
  std::vector<MarchRay> rays;
  std::vector<Run> runs;
  std::vector<Bend> bends;  // for curved rays, one per run
  std::vector<std::uint32_t> pixels;
  std::vector<int> subsets;
  std::uint32_t samples = 0;
  std::vector<RayCounts> counts;  // by subset
};

/// Calls act(subset, pixel of the view) for all of a tile's pixels that belong to a subset.
template <class Act>
void each_pixel(const PixelTile& tile, const PixelRays& camera, const RayListOptions& options,
                const Act& act) {
  for (int y = tile.y0; y < tile.y1; ++y)
    for (int x = tile.x0; x < tile.x1; ++x) {
      const int subset =
          options.subset_of ? options.subset_of(tile.view, x, y) : options.rule(tile.view, x, y);
      if (subset >= 0)
        act(subset, static_cast<std::uint32_t>(y) * camera.width + static_cast<std::uint32_t>(x));
    }
}

/// Adds one ray; each_run(emit) gives its runs. Runs of curved rays have bends.
enum class Rays { straight, curved };
template <class EachRun>
void add_ray(TileRays& out, int subset, std::uint32_t pixel, MarchRay ray, Rays rays,
             const EachRun& each_run) {
  ray.first_run = static_cast<std::uint32_t>(out.runs.size());
  const std::uint32_t before = out.samples;
  each_run([&](Run run, const float* from, const float* along) {
    run.first_sample = out.samples;
    out.samples += static_cast<std::uint32_t>(run.count);
    out.runs.push_back(run);
    if (rays == Rays::curved)
      out.bends.push_back({{from[0], from[1], from[2]}, {along[0], along[1], along[2]}});
  });
  ray.runs = static_cast<std::uint32_t>(out.runs.size()) - ray.first_run;
  if (ray.runs == 0) return;
  out.rays.push_back(ray);
  out.pixels.push_back(pixel);
  out.subsets.push_back(subset);
  RayCounts& counts = out.counts[static_cast<std::size_t>(subset)];
  counts = counts + RayCounts{1, ray.runs, out.samples - before};
}

/// Straight rays, one bundle at a time.
class BundledPixels {
 public:
  BundledPixels(const CutRay& cut, const float* origin, TileRays& out) : cut_(cut), out_(out) {
    bundle_.origin = origin;
  }

  void add(int subset, std::uint32_t pixel, const MarchRay& ray) {
    const auto lane = static_cast<std::size_t>(bundle_.rays++);
    for (int a = 0; a < 3; ++a) bundle_.direction[a][lane] = ray.direction[a];
    pixels_[lane] = {subset, pixel, ray};
    if (bundle_.rays == RayBundle::kMost) clip();
  }
  void clip() {
    clip_bundle(cut_.voxels, cut_.blocks, bundle_, crossings_);
    for (std::size_t lane = 0; lane < static_cast<std::size_t>(bundle_.rays); ++lane) {
      const std::vector<float>& t = crossings_[lane];
      const Pixel& p = pixels_[lane];
      add_ray(out_, p.subset, p.pixel, p.ray, Rays::straight, [&](const auto& emit) {
        float before = 0;
        for (std::size_t i = 0; i + 1 < t.size(); i += 2)
          cut_.cut_stretch(bundle_.origin, p.ray.direction, t[i], t[i + 1], before, emit);
      });
    }
    bundle_.rays = 0;
  }

 private:
  struct Pixel {
    int subset = 0;
    std::uint32_t pixel = 0;
    MarchRay ray;
  };
  const CutRay& cut_;
  TileRays& out_;
  RayBundle bundle_;
  Crossings crossings_;
  std::array<Pixel, RayBundle::kMost> pixels_;
};

TileRays clip_tile(const CutRay& cut, const PixelRays& camera, const float* origin, const PixelTile& tile,
                   const RayListOptions& options) {
  TileRays out;
  out.counts.resize(static_cast<std::size_t>(options.subsets));
  BundledPixels straight(cut, origin, out);
  each_pixel(tile, camera, options, [&](int subset, std::uint32_t pixel) {
    MarchRay ray;
    camera(pixel, ray.direction);
    ray.view = tile.view;
    if (options.gas == nullptr) return straight.add(subset, pixel, ray);
    add_ray(out, subset, pixel, ray, Rays::curved,
            [&](const auto& emit) { cut(origin, ray.direction, emit); });
  });
  straight.clip();
  return out;
}

/// Sorts by subset, with tiles in order, so that the list is independent of the threads.
void assemble(std::vector<TileRays>& tiles, int subsets, bool curved, RayList& list, Pool& pool) {
  RayCounts next;
  list.subset_begin.push_back(0);
  list.before.push_back(next);
  for (int s = 0; s < subsets; ++s) {
    for (TileRays& tile : tiles) {
      RayCounts& counts = tile.counts[static_cast<std::size_t>(s)];
      std::swap(counts, next);  // converts counts to offsets
      next = next + counts;
    }
    list.subset_begin.push_back(next.rays);
    list.before.push_back(next);
  }
  list.rays.resize(next.rays);
  list.pixels.resize(next.rays);
  list.runs.resize(next.runs);
  if (curved) list.bends.resize(next.runs);
  constexpr int kTasks = 64;
  pool.run(kTasks, [&](int task) {
    const Slice mine = slice(tiles.size(), kTasks, task);
    for (std::size_t n = mine.begin; n < mine.end; ++n) {
      TileRays& tile = tiles[n];
      for (std::size_t r = 0; r < tile.rays.size(); ++r) {
        RayCounts& to = tile.counts[static_cast<std::size_t>(tile.subsets[r])];
        MarchRay ray = tile.rays[r];
        const std::size_t from = ray.first_run;
        ray.first_run = to.runs;
        list.pixels[to.rays] = tile.pixels[r];
        for (std::uint32_t i = 0; i < ray.runs; ++i) {
          Run run = tile.runs[from + i];
          run.ray = to.rays;
          run.first_sample = to.samples;
          to.samples += static_cast<std::uint32_t>(run.count);
          if (curved) list.bends[to.runs] = tile.bends[from + i];
          list.runs[to.runs++] = run;
        }
        list.rays[to.rays++] = ray;
      }
    }
  });
}

std::vector<PixelTile> tiles_of(const std::vector<const CameraModel*>& cameras, const Grid& grid,
                                const RayListOptions& options) {
  std::vector<PixelTile> tiles;
  for (std::size_t v = 0; v < cameras.size(); ++v) {
    const PixelBox box = part_of(cameras, v, grid, options);
    for (int y = box.y0; y < box.y1; y += kTile)
      for (int x = box.x0; x < box.x1; x += kTile)
        tiles.push_back(
            {static_cast<std::uint32_t>(v), x, y, std::min(x + kTile, box.x1), std::min(y + kTile, box.y1)});
  }
  return tiles;
}

std::vector<PixelRays> rays_of(const std::vector<const CameraModel*>& cameras) {
  std::vector<PixelRays> rays;
  rays.reserve(cameras.size());
  for (const CameraModel* camera : cameras) rays.push_back(pixel_rays(*camera));
  return rays;
}

}  // namespace

double total_length(const RayList& list, Pool& pool) {
  const auto chunks = (std::size_t{list.count().runs} + SumLengths::kRuns - 1) / SumLengths::kRuns;
  std::vector<double> sums(chunks);
  if (kCudaBuilt && list.on_gpu) {
    lengths_on_cuda(*list.on_gpu, sums);
  } else {
    const SumLengths act{list.runs.data(), list.runs.size(), sums.data()};
    pool.run(static_cast<int>(chunks), [&](int chunk) { act(static_cast<std::size_t>(chunk)); });
  }
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

CroppedHull crop_to_medium(const Hull& hull) {
  const Grid& g = hull.grid;
  int low[3] = {g.nx, g.ny, g.nz};
  int high[3] = {-1, -1, -1};
  const auto width = static_cast<std::size_t>(g.nx - 1);
  const std::uint8_t* row = hull.inside.data();
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j, row += width) {
      const void* first = std::memchr(row, 1, width);
      if (first == nullptr) continue;  // as most are
      const auto begin = static_cast<int>(static_cast<const std::uint8_t*>(first) - row);
      auto end = static_cast<int>(width);
      while (row[end - 1] == 0) --end;
      const int from[3] = {begin, j, k};
      const int to[3] = {end - 1, j, k};
      for (int a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], from[a]);
        high[a] = std::max(high[a], to[a]);
      }
    }
  CroppedHull crop;
  if (high[0] < 0) return {whole_grid(g), {0, 0, 0}};
  Grid& c = crop.hull.grid;
  c = g;
  c.nx = high[0] - low[0] + 2;
  c.ny = high[1] - low[1] + 2;
  c.nz = high[2] - low[2] + 2;
  for (int a = 0; a < 3; ++a) {
    crop.offset[a] = low[a];
    c.origin[a] = g.origin[a] + static_cast<float>(low[a]) * g.edge;
  }
  crop.hull.count = hull.count;
  crop.hull.inside.reserve(voxel_index(c, 0, 0, c.nz - 1));
  for (int k = 0; k < c.nz - 1; ++k) {
    for (int j = 0; j < c.ny - 1; ++j) {
      const auto cropped =
          hull.inside.begin() + static_cast<std::ptrdiff_t>(voxel_index(g, low[0], low[1] + j, low[2] + k));
      crop.hull.inside.insert(crop.hull.inside.end(), cropped, cropped + (c.nx - 1));
    }
  }
  return crop;
}

Hull coarsen(const Hull& hull) {
  const Grid& g = hull.grid;
  Hull out;
  out.grid = g;
  out.grid.edge = 2 * g.edge;
  out.grid.nx = g.nx / 2 + 1;
  out.grid.ny = g.ny / 2 + 1;
  out.grid.nz = g.nz / 2 + 1;
  out.inside.resize(voxel_index(out.grid, 0, 0, out.grid.nz - 1));
  const auto width = static_cast<std::size_t>(g.nx - 1);
  const std::uint8_t* row = hull.inside.data();
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j, row += width) {
      if (std::memchr(row, 1, width) == nullptr) continue;  // as most are
      std::uint8_t* to = &out.inside[voxel_index(out.grid, 0, j / 2, k / 2)];
      for (std::size_t i = 0; i < width; ++i) to[i / 2] |= row[i];
    }
  out.count = static_cast<std::size_t>(std::count(out.inside.begin(), out.inside.end(), 1));
  return out;
}

PixelsInOrder pixels_in_order(const std::vector<const CameraModel*>& cameras, const Grid& grid,
                              const RayListOptions& options, Pool& pool) {
  const auto subsets = static_cast<std::size_t>(options.subsets);
  const std::vector<PixelTile> tiles = tiles_of(cameras, grid, options);
  const std::vector<PixelRays> rays = rays_of(cameras);
  std::vector<std::vector<std::size_t>> place(tiles.size(), std::vector<std::size_t>(subsets));
  const auto each_tile = [&](const auto& act) {
    pool.run(static_cast<int>(tiles.size()), [&](int task) {
      const auto t = static_cast<std::size_t>(task);
      each_pixel(tiles[t], rays[tiles[t].view], options, [&](int subset, std::uint32_t pixel) {
        act(place[t][static_cast<std::size_t>(subset)]++, PixelOfView{tiles[t].view, pixel});
      });
    });
  };
  each_tile([](std::size_t, const PixelOfView&) {});
  PixelsInOrder out;
  std::size_t next = 0;
  for (std::size_t s = 0; s < subsets; ++s) {
    out.subset_begin.push_back(next);
    for (auto& tile : place) {
      std::swap(tile[s], next);  // converts counts to offsets
      next += tile[s];
    }
  }
  out.subset_begin.push_back(next);
  out.pixels.resize(next);
  each_tile([&](std::size_t at, const PixelOfView& pixel) { out.pixels[at] = pixel; });
  return out;
}

namespace {

/// Where all pixels that may have rays are dealt to subsets on the GPU, by the options' rule.
[[maybe_unused]] std::vector<TiledView> tiled_views(const std::vector<const CameraModel*>& cameras,
                                                    const Grid& grid, const RayListOptions& options) {
  std::vector<TiledView> views;
  std::uint32_t slot = 0;
  for (std::size_t v = 0; v < cameras.size(); ++v) {
    const PixelBox part = part_of(cameras, v, grid, options);
    TiledView view{part.x0, part.y0, part.x1, part.y1, cameras[v]->intrinsics.size.width, slot};
    if (part.empty()) view.x1 = view.x0;
    slot += static_cast<std::uint32_t>(view.tiles_across() * view.tiles_down() * kTile * kTile);
    views.push_back(view);
  }
  return views;
}

}  // namespace

RayList clip_rays(const std::vector<const CameraModel*>& cameras, const Hull& medium,
                  const RayListOptions& options, Pool& pool) {
  RayList list;
  list.grid = medium.grid;
  for (const CameraModel* camera : cameras) {
    const Eigen::Vector3d center = camera->center();
    for (int a = 0; a < 3; ++a)
      list.origins.push_back(static_cast<float>((center[a] - static_cast<double>(medium.grid.origin[a])) /
                                                static_cast<double>(medium.grid.edge)));
  }
  const std::vector<PixelRays> rays = rays_of(cameras);
  const Cutter cutter(medium, options);
  if constexpr (kCudaBuilt) {
    if (pool.device() == Device::cuda) {
      if (options.subset_of)
        cut_on_cuda(cutter.cut(), rays, pixels_in_order(cameras, medium.grid, options, pool), options, list);
      else
        cut_on_cuda(cutter.cut(), rays, tiled_views(cameras, medium.grid, options), options, list);
      return list;
    }
  }
  const std::vector<PixelTile> tiles = tiles_of(cameras, medium.grid, options);
  std::vector<TileRays> found(tiles.size());
  pool.run(static_cast<int>(tiles.size()), [&](int t) {
    const PixelTile& tile = tiles[static_cast<std::size_t>(t)];
    found[static_cast<std::size_t>(t)] = clip_tile(
        cutter.cut(), rays[tile.view], &list.origins[3 * static_cast<std::size_t>(tile.view)], tile, options);
  });
  list.curved = options.gas != nullptr;
  assemble(found, options.subsets, list.curved, list, pool);
  return list;
}

}  // namespace emberlock::recon
