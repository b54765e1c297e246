#include "recon/hull/ray_list.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "recon/calibrate/camera_model.h"
#include "recon/hull/hull.h"
#include "recon/kernels/clip.h"

namespace emberlock {
namespace {

std::size_t voxel_index(const Grid& g, int i, int j, int k) {
  return static_cast<std::size_t>(i) +
         static_cast<std::size_t>(g.nx - 1) *
             (static_cast<std::size_t>(j) + static_cast<std::size_t>(g.ny - 1) * static_cast<std::size_t>(k));
}

/// Pixels whose rays can meet the grid's box: the rectangle around its projected corners, or the whole frame
/// when the camera is so close that a corner lies behind it, or when distortion bends the box's edges
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

/// Neighbouring rays read the same key points: what a tile's rays read stays in the nearest cache.
constexpr int kTile = 16;
struct PixelTile {
  std::uint32_t view;
  int x0, y0, x1, y1;
};

struct Counts {
  std::uint32_t rays = 0, runs = 0, samples = 0;
};

/// What one tile of pixels gives; runs are counted from the tile's own first.
struct TileRays {
  std::vector<MarchRay> rays;
  std::vector<Run> runs;
  std::vector<Bend> bends;  // of curved rays, one a run
  std::vector<std::uint32_t> pixels;
  std::vector<int> subsets;
  std::uint32_t samples = 0;
  std::vector<Counts> counts;  // of each subset
};

class TileClipper {
 public:
  TileClipper(const Hull& medium, const RayListOptions& options) : options_(options) {
    const Grid& g = medium.grid;
    voxels_ = {g.nx - 1, g.ny - 1, g.nz - 1, nullptr};
    const auto blocks = [](int voxels) { return (voxels + kBlock - 1) / kBlock; };
    blocks_ = {blocks(voxels_.mx), blocks(voxels_.my), blocks(voxels_.mz), nullptr};
    inside_.resize(voxels_.size());
    occupied_.resize(blocks_.size());
    std::size_t voxel = 0;
    for (int k = 0; k < voxels_.mz; ++k)
      for (int j = 0; j < voxels_.my; ++j)
        for (int i = 0; i < voxels_.mx; ++i)
          if (medium.inside[voxel++] != 0) {
            inside_[voxels_.index(i, j, k)] = 1;
            occupied_[blocks_.index(i / kBlock, j / kBlock, k / kBlock)] = 1;
          }
    voxels_.inside = inside_.data();
    blocks_.inside = occupied_.data();
  }

  TileRays operator()(const CameraModel& camera, const float* origin, const PixelTile& tile) const {
    TileRays out;
    out.counts.resize(static_cast<std::size_t>(options_.subsets));
    const Intrinsics& k = camera.intrinsics;
    const Eigen::Matrix3d world_from_camera = camera.camera_from_world.rotation.transpose();
    const bool straight = k.distortion.none();
    for (int y = tile.y0; y < tile.y1; ++y)
      for (int x = tile.x0; x < tile.x1; ++x) {
        const int subset = options_.subset_of ? options_.subset_of(tile.view, x, y) : 0;
        if (subset < 0) continue;
        const Eigen::Vector2d centre(x + 0.5, y + 0.5);
        const Eigen::Vector3d d = straight
                                      ? (world_from_camera * Eigen::Vector3d((centre.x() - k.cx) / k.fx,
                                                                             (centre.y() - k.cy) / k.fy, 1))
                                            .normalized()
                                      : camera.ray(centre).direction;
        MarchRay ray;
        for (int a = 0; a < 3; ++a) ray.direction[a] = static_cast<float>(d[a]);
        ray.view = tile.view;
        ray.first_run = static_cast<std::uint32_t>(out.runs.size());
        const std::uint32_t before = out.samples;
        add_runs(origin, ray, out);
        if (ray.runs == 0) continue;
        out.rays.push_back(ray);
        out.pixels.push_back(static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(k.size.width) +
                             static_cast<std::uint32_t>(x));
        out.subsets.push_back(subset);
        Counts& counts = out.counts[static_cast<std::size_t>(subset)];
        ++counts.rays;
        counts.runs += ray.runs;
        counts.samples += out.samples - before;
      }
    return out;
  }

 private:
  void add_runs(const float* origin, MarchRay& ray, TileRays& out) const {
    float before = 0;
    if (options_.gas == nullptr) {
      add_stretch(origin, ray.direction, kEndless, before, ray, out);
      return;
    }
    trace(*options_.gas, origin, ray.direction, [&](const float* from, const float* direction, float length) {
      const std::uint32_t runs = ray.runs;
      add_stretch(from, direction, length, before, ray, out);
      const Bend bend{{from[0], from[1], from[2]}, {direction[0], direction[1], direction[2]}};
      out.bends.insert(out.bends.end(), ray.runs - runs, bend);
    });
  }

  /// The runs of a straight line's first `length` edges; `before` is what lies inside the medium in front of
  /// it.
  void add_stretch(const float* origin, const float* direction, float length, float& before, MarchRay& ray,
                   TileRays& out) const {
    clip_to_medium(voxels_, blocks_, origin, direction, [&](float t0, float t1) {
      constexpr float kSliver = 1e-4F;  // voxel edges; a corner that is barely touched adds nothing
      t1 = std::min(t1, length);
      if (t1 - t0 < kSliver) return;
      const int count = std::max(1, static_cast<int>(std::ceil((t1 - t0) / options_.step - 1e-3F)));
      const float step = (t1 - t0) / static_cast<float>(count);
      cut_at_slabs(origin[2], direction[2], t0, step, count, voxels_.mz, [&](int first, int size) {
        const float ahead = static_cast<float>(first) * step;
        // The middle sample tells the slab: the first may have been rounded across the border.
        const int middle = first + size / 2;
        const float t = t0 + (static_cast<float>(middle) + 0.5F) * step;
        const int slab = clamp_cell(origin[2] + direction[2] * t, voxels_.mz + 1) / kSlab;
        out.runs.push_back({t0 + ahead, step, before + ahead, 0, out.samples, size, slab});
        out.samples += static_cast<std::uint32_t>(size);
        ++ray.runs;
      });
      before += t1 - t0;
    });
  }

  std::vector<std::uint8_t> inside_, occupied_;
  VoxelMask voxels_, blocks_;
  const RayListOptions& options_;
};

/// Sorts by subset, tiles in order, so that the list doesn't depend on which thread did which tile.
void assemble(std::vector<TileRays>& tiles, int subsets, bool curved, RayList& list, Pool& pool) {
  Counts next;
  list.subset_begin.push_back(0);
  for (int s = 0; s < subsets; ++s) {
    for (TileRays& tile : tiles) {
      Counts& counts = tile.counts[static_cast<std::size_t>(s)];
      std::swap(counts, next);  // from how many there are to where they go
      next.rays += counts.rays;
      next.runs += counts.runs;
      next.samples += counts.samples;
    }
    list.subset_begin.push_back(next.rays);
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
        Counts& to = tile.counts[static_cast<std::size_t>(tile.subsets[r])];
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

}  // namespace

std::size_t RayList::first_sample(std::size_t ray) const {
  if (runs.empty()) return 0;
  const std::size_t run = first_run(ray);
  return run < runs.size() ? runs[run].first_sample
                           : runs.back().first_sample + static_cast<std::size_t>(runs.back().count);
}

CroppedHull crop_to_medium(const Hull& hull) {
  const Grid& g = hull.grid;
  int low[3] = {g.nx, g.ny, g.nz};
  int high[3] = {-1, -1, -1};
  std::size_t at = 0;
  for (int k = 0; k < g.nz - 1; ++k) {
    for (int j = 0; j < g.ny - 1; ++j) {
      for (int i = 0; i < g.nx - 1; ++i) {
        if (hull.inside[at++] == 0) continue;
        const int voxel[3] = {i, j, k};
        for (int a = 0; a < 3; ++a) {
          low[a] = std::min(low[a], voxel[a]);
          high[a] = std::max(high[a], voxel[a]);
        }
      }
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
      const auto row =
          hull.inside.begin() + static_cast<std::ptrdiff_t>(voxel_index(g, low[0], low[1] + j, low[2] + k));
      crop.hull.inside.insert(crop.hull.inside.end(), row, row + (c.nx - 1));
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
  std::size_t at = 0;
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j)
      for (int i = 0; i < g.nx - 1; ++i)
        if (hull.inside[at++] != 0) out.inside[voxel_index(out.grid, i / 2, j / 2, k / 2)] = 1;
  out.count = static_cast<std::size_t>(std::count(out.inside.begin(), out.inside.end(), 1));
  return out;
}

RayList clip_rays(const std::vector<const CameraModel*>& cameras, const Hull& medium,
                  const RayListOptions& options, Pool& pool) {
  RayList list;
  list.grid = medium.grid;
  std::vector<PixelTile> tiles;
  for (std::size_t v = 0; v < cameras.size(); ++v) {
    const Eigen::Vector3d center = cameras[v]->center();
    for (int a = 0; a < 3; ++a)
      list.origins.push_back(static_cast<float>((center[a] - static_cast<double>(medium.grid.origin[a])) /
                                                static_cast<double>(medium.grid.edge)));
    const PixelBox box = reach(*cameras[v], medium.grid);
    for (int y = box.y0; y < box.y1; y += kTile)
      for (int x = box.x0; x < box.x1; x += kTile)
        tiles.push_back(
            {static_cast<std::uint32_t>(v), x, y, std::min(x + kTile, box.x1), std::min(y + kTile, box.y1)});
  }
  std::vector<TileRays> found(tiles.size());
  const TileClipper clip(medium, options);
  pool.run(static_cast<int>(tiles.size()), [&](int t) {
    const PixelTile& tile = tiles[static_cast<std::size_t>(t)];
    found[static_cast<std::size_t>(t)] =
        clip(*cameras[tile.view], &list.origins[3 * static_cast<std::size_t>(tile.view)], tile);
  });
  assemble(found, options.subsets, options.gas != nullptr, list, pool);
  return list;
}

}  // namespace emberlock
