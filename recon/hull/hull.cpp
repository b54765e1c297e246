// SPDX-License-Identifier: Apache-2.0
#include "recon/hull/hull.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include <fmt/format.h>

#include "recon/compute/pool.h"
#include "recon/hull/hull_cuda.h"
#include "recon/hull/kernel_views.h"
#include "recon/kernels/carve.h"

namespace emberlock::recon {
namespace {

constexpr std::size_t kMaxViews = 64;  // one bit each in a cube's set of open views

struct Seen {
  const View* view;
  const FlameMask* mask;
};

std::vector<std::uint32_t> summed_area(const FlameMask& mask) {
  const auto width = static_cast<std::size_t>(mask.size.width);
  const auto height = static_cast<std::size_t>(mask.size.height);
  std::vector<std::uint32_t> sums((width + 1) * (height + 1));
  const FlameTable table{mask.flame.data(), sums.data(), mask.size.width, mask.size.height};
  for (std::size_t y = 0; y < height; ++y) SumAlongRow{&table, height}(y);
  constexpr std::size_t kStrip = 16;
  const std::size_t strips = width / kStrip + 1;
  for (std::size_t s = 0; s < strips; ++s) SumDownColumns{&table, strips, kStrip}(s);
  return sums;
}

/// Descends from large cubes to voxels.
class Carver {
 public:
  Carver(const ClassifyCubes& cubes, Hull& hull) : cubes_(cubes), hull_(hull) {}

  /// `open` holds the views that the cube's ancestors did not settle.
  void carve(int i, int j, int k, int size, std::uint64_t open) {
    const Grid& g = hull_.grid;
    if (i >= g.nx - 1 || j >= g.ny - 1 || k >= g.nz - 1) return;
    if (cubes_.carved(i, j, k, size, open)) return;
    if (open == 0 || size == 1) return keep(i, j, k, size);
    const int half = size / 2;
    for (int child = 0; child < 8; ++child)
      carve(i + (child & 1) * half, j + ((child >> 1) & 1) * half, k + (child >> 2) * half, half, open);
  }

 private:
  void keep(int i, int j, int k, int size) {
    const Grid& g = hull_.grid;
    const auto row = static_cast<std::size_t>(g.nx - 1);
    const int width = std::min(size, g.nx - 1 - i);
    for (int z = k; z < std::min(k + size, g.nz - 1); ++z)
      for (int y = j; y < std::min(j + size, g.ny - 1); ++y)
        std::fill_n(hull_.inside.begin() +
                        static_cast<std::ptrdiff_t>(
                            static_cast<std::size_t>(i) +
                            row * (static_cast<std::size_t>(y) +
                                   static_cast<std::size_t>(g.ny - 1) * static_cast<std::size_t>(z))),
                    width, std::uint8_t{1});
  }

  const ClassifyCubes& cubes_;
  Hull& hull_;
};

std::size_t voxels(const Grid& g) {
  return static_cast<std::size_t>(g.nx - 1) * static_cast<std::size_t>(g.ny - 1) *
         static_cast<std::size_t>(g.nz - 1);
}

void carve_voxels(const std::vector<Seen>& seen, Hull& hull, Pool& pool) {
  std::vector<Silhouette> views;
  std::vector<const FlameMask*> masks;
  for (const Seen& s : seen) {
    views.push_back(silhouette(s.view->camera));
    masks.push_back(s.mask);
  }
  if constexpr (kCudaBuilt) {
    if (pool.device() == Device::cuda) return carve_on_cuda(hull.grid, std::move(views), masks, hull.inside);
  }
  std::vector<std::vector<std::uint32_t>> tables(seen.size());
  pool.run(static_cast<int>(seen.size()), [&](int view) {
    const auto v = static_cast<std::size_t>(view);
    tables[v] = summed_area(*seen[v].mask);
    views[v].flame_pixels = tables[v].data();
  });
  const ClassifyCubes classify{{hull.grid}, views.data(), static_cast<int>(views.size())};
  constexpr int kRoot = ClassifyCubes::kRoot;
  const auto cubes = [](int key_points) { return (key_points - 2 + kRoot) / kRoot; };
  const int bx = cubes(hull.grid.nx);
  const int by = cubes(hull.grid.ny);
  pool.run(bx * by * cubes(hull.grid.nz), [&](int cube) {
    Carver(classify, hull)
        .carve(cube % bx * kRoot, cube / bx % by * kRoot, cube / bx / by * kRoot, kRoot, classify.all());
  });
}

Hull carve_by(const std::vector<Seen>& seen, const Grid& grid, Pool& pool) {
  Hull hull{grid, std::vector<std::uint8_t>(voxels(grid)), 0};
  carve_voxels(seen, hull, pool);
  hull.count = std::accumulate(hull.inside.begin(), hull.inside.end(), std::size_t{0});
  return hull;
}

/// Which view alone carves most of the volume: the likely culprit of an empty hull.
Error empty_hull(const std::vector<Seen>& seen, const Grid& grid, Pool& pool) {
  const Seen* worst = &seen.front();
  std::size_t least = voxels(grid) + 1;
  for (const Seen& s : seen) {
    const std::size_t left = carve_by({s}, grid, pool).count;
    if (left < least) {
      least = left;
      worst = &s;
    }
  }
  const std::string threshold = fmt::format("{:.3g}", worst->mask->threshold);
  const std::string share = least == 0 ? "everything" : "most";
  const std::string flame = worst->mask->box.empty() ? "it has no pixel" : "its pixels";
  return {ErrorKind::bad_input,
          "the visual hull is empty: this view alone carves " + share + ", with " + flame +
              " above the threshold of " + threshold + " grey levels",
          worst->view->name,
          "Check that the box holds the flame and that the cameras' poses are right, lower the flame "
          "threshold, or leave the view out"};
}

}  // namespace

Grid grid_over(const Box& box, int voxels_along) {
  Grid g;
  const double edge = box.size.maxCoeff() / voxels_along;
  int* counts[3] = {&g.nx, &g.ny, &g.nz};
  for (int a = 0; a < 3; ++a) {
    const int n = std::max(1, static_cast<int>(std::ceil(box.size[a] / edge - 1e-6)));
    *counts[a] = n + 1;
    g.origin[a] = static_cast<float>(box.center[a] - 0.5 * n * edge);
  }
  g.edge = static_cast<float>(edge);
  return g;
}

Hull whole_grid(const Grid& grid) { return {grid, std::vector<std::uint8_t>(voxels(grid), 1), voxels(grid)}; }

Result<Hull> carve(const Scene& scene, const std::vector<FlameMask>& masks, const Grid& grid,
                   const ComputeOptions& compute) try {
  std::vector<Seen> seen;
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    if (scene.views[v].role == ViewRole::input) seen.push_back({&scene.views[v], &masks[v]});
  if (seen.empty())
    return Error{ErrorKind::bad_input, "no input view", "scene",
                 "Give at least one view that is not held out"};
  if (seen.size() > kMaxViews)
    return Error{ErrorKind::bad_input, std::to_string(seen.size()) + " input views", "scene",
                 "Give 64 at most"};
  Pool pool(compute);
  Hull hull = carve_by(seen, grid, pool);
  if (hull.count == 0) return empty_hull(seen, grid, pool);
  return hull;
} catch (const DeviceError& e) {
  return e.error();
}

}  // namespace emberlock::recon
