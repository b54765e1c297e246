#include "recon/hull/hull.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>

#include "recon/compute/pool.h"
#include "recon/kernels/footprint.h"

namespace emberlock {
namespace {

constexpr int kRootCube = 16;
constexpr std::size_t kMaxViews = 64;  // one bit each in a cube's set of open views

struct Seen {
  const View* view;
  const FlameMask* mask;
  std::vector<std::uint32_t> table;
  Silhouette silhouette;
};

std::vector<std::uint32_t> summed_area(const FlameMask& mask) {
  const auto width = static_cast<std::size_t>(mask.size.width);
  const auto height = static_cast<std::size_t>(mask.size.height);
  std::vector<std::uint32_t> table((width + 1) * (height + 1));
  for (std::size_t y = 0; y < height; ++y) {
    std::uint32_t row = 0;
    for (std::size_t x = 0; x < width; ++x) {
      row += mask.flame[y * width + x];
      table[(y + 1) * (width + 1) + x + 1] = table[y * (width + 1) + x + 1] + row;
    }
  }
  return table;
}

Silhouette silhouette(const CameraModel& camera, const std::vector<std::uint32_t>& table) {
  Silhouette s;
  const Intrinsics& k = camera.intrinsics;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c)
      s.rotation[3 * r + c] = static_cast<float>(camera.camera_from_world.rotation(r, c));
    s.translation[r] = static_cast<float>(camera.camera_from_world.translation(r));
  }
  s.fx = static_cast<float>(k.fx);
  s.fy = static_cast<float>(k.fy);
  s.cx = static_cast<float>(k.cx);
  s.cy = static_cast<float>(k.cy);
  s.k1 = static_cast<float>(k.distortion.k1);
  s.k2 = static_cast<float>(k.distortion.k2);
  s.p1 = static_cast<float>(k.distortion.p1);
  s.p2 = static_cast<float>(k.distortion.p2);
  s.k3 = static_cast<float>(k.distortion.k3);
  s.width = k.size.width;
  s.height = k.size.height;
  s.flame_pixels = table.data();
  return s;
}

/// Descends from large cubes to voxels. `open` holds a bit for each view that a cube's ancestors did not
/// settle.
class Carver {
 public:
  Carver(const std::vector<Seen>& seen, Hull& hull) : seen_(seen), hull_(hull), judge_{hull.grid} {}

  void carve(int i, int j, int k, int size, std::uint64_t open) {
    const Grid& g = hull_.grid;
    if (i >= g.nx - 1 || j >= g.ny - 1 || k >= g.nz - 1) return;
    for (std::size_t v = 0; v < seen_.size(); ++v) {
      if ((open >> v & 1) == 0) continue;
      const Verdict verdict = judge_(seen_[v].silhouette, i, j, k, size);
      if (verdict == Verdict::carved) return;
      if (verdict == Verdict::flame) open &= ~(std::uint64_t{1} << v);
    }
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

  const std::vector<Seen>& seen_;
  Hull& hull_;
  JudgeCube judge_;
};

std::size_t voxels(const Grid& g) {
  return static_cast<std::size_t>(g.nx - 1) * static_cast<std::size_t>(g.ny - 1) *
         static_cast<std::size_t>(g.nz - 1);
}

Hull carve_by(const std::vector<Seen>& seen, const Grid& grid, Pool& pool) {
  Hull hull{grid, std::vector<std::uint8_t>(voxels(grid)), 0};
  const auto cubes = [](int key_points) { return (key_points - 2 + kRootCube) / kRootCube; };
  const int bx = cubes(grid.nx);
  const int by = cubes(grid.ny);
  const std::uint64_t all =
      seen.size() == kMaxViews ? ~std::uint64_t{0} : (std::uint64_t{1} << seen.size()) - 1;
  pool.run(bx * by * cubes(grid.nz), [&](int cube) {
    Carver(seen, hull)
        .carve(cube % bx * kRootCube, cube / bx % by * kRootCube, cube / bx / by * kRootCube, kRootCube, all);
  });
  hull.count = std::accumulate(hull.inside.begin(), hull.inside.end(), std::size_t{0});
  return hull;
}

/// Which view alone carves most of the volume: the likely culprit of an empty hull.
Error empty_hull(std::vector<Seen>& seen, const Grid& grid, Pool& pool) {
  const Seen* worst = &seen.front();
  std::size_t least = voxels(grid) + 1;
  for (Seen& s : seen) {
    std::vector<Seen> alone;
    alone.push_back(s);
    alone.front().silhouette.flame_pixels = alone.front().table.data();
    const std::size_t left = carve_by(alone, grid, pool).count;
    if (left < least) {
      least = left;
      worst = &s;
    }
  }
  char threshold[32];
  std::snprintf(threshold, sizeof threshold, "%.3g", worst->mask->threshold);
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
                   const ComputeOptions& compute) {
  std::vector<Seen> seen;
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    if (scene.views[v].role == ViewRole::input) seen.push_back({&scene.views[v], &masks[v], {}, {}});
  if (seen.empty())
    return Error{ErrorKind::bad_input, "no input view", "scene",
                 "Give at least one view that is not held out"};
  if (seen.size() > kMaxViews)
    return Error{ErrorKind::bad_input, std::to_string(seen.size()) + " input views", "scene",
                 "Give 64 at most"};
  Pool pool(compute.threads);
  pool.run(static_cast<int>(seen.size()), [&](int v) {
    Seen& s = seen[static_cast<std::size_t>(v)];
    s.table = summed_area(*s.mask);
    s.silhouette = silhouette(s.view->camera, s.table);
  });
  Hull hull = carve_by(seen, grid, pool);
  if (hull.count == 0) return empty_hull(seen, grid, pool);
  return hull;
}

}  // namespace emberlock
