// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/gaussian_splats/gaussian_splats.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "paper/baselines/gaussian_splats/splat_fit.h"
#include "paper/baselines/linear_projector.h"
#include "recon/adjust/picture_error.h"
#include "recon/render/render.h"

namespace emberlock::paper {
namespace {

constexpr float kFar = 4;  // standard deviations to which a splat is put on key points

/// The key points that one splat reaches, and its value over its light at (x, y, z).
struct Reach {
  int low[3], high[3];
  std::array<float, 3> centre;
  std::array<float, 6> w;

  Reach(const Splat& splat, const recon::Grid& grid)
      : low{},
        high{},
        centre{splat[kCentre], splat[kCentre + 1], splat[kCentre + 2]},
        w(sharpness_of(splat)) {
    // Along each axis sqrt(Sigma_aa) = |row a of W^-1|.
    const float inverse[6] = {1 / w[0],
                              -w[1] / (w[0] * w[2]),
                              1 / w[2],
                              (w[1] * w[4] - w[2] * w[3]) / (w[0] * w[2] * w[5]),
                              -w[4] / (w[2] * w[5]),
                              1 / w[5]};
    const float sigma[3] = {inverse[0], std::hypot(inverse[1], inverse[2]),
                            std::hypot(inverse[3], inverse[4], inverse[5])};
    const int size[3] = {grid.nx, grid.ny, grid.nz};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto last = static_cast<float>(size[a]);
      low[a] = static_cast<int>(std::ceil(std::clamp(centre[a] - kFar * sigma[a], 0.F, last)));
      high[a] = static_cast<int>(std::floor(std::clamp(centre[a] + kFar * sigma[a], -1.F, last - 1)));
    }
  }
  [[nodiscard]] float at(int i, int j, int k) const {
    const float x = static_cast<float>(i) - centre[0];
    const float y = static_cast<float>(j) - centre[1];
    const float z = static_cast<float>(k) - centre[2];
    const float u[3] = {w[0] * x, w[1] * x + w[2] * y, w[3] * x + w[4] * y + w[5] * z};
    return std::exp(-0.5F * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]));
  }
  [[nodiscard]] bool within(const recon::Grid& grid) const {
    return low[0] > 0 && low[1] > 0 && low[2] > 0 && high[0] < grid.nx - 1 && high[1] < grid.ny - 1 &&
           high[2] < grid.nz - 1;
  }
};

/// What makes the sum over key points the integral: 1 for those that lie partly beyond the grid.
float correction(const Splat& splat, const Reach& reach, const recon::Grid& grid) {
  if (!reach.within(grid)) return 1;
  double sum = 0;
  for (int k = reach.low[2]; k <= reach.high[2]; ++k)
    for (int j = reach.low[1]; j <= reach.high[1]; ++j)
      for (int i = reach.low[0]; i <= reach.high[0]; ++i) sum += static_cast<double>(reach.at(i, j, k));
  return sum > 0 ? static_cast<float>(static_cast<double>(volume_of(splat)) / sum) : 1;
}

/// The voxels with light at a corner.
recon::Hull lit_voxels(const recon::Volume& volume) {
  const recon::Grid& g = volume.grid;
  recon::Hull lit = recon::whole_grid(g);
  std::size_t voxel = 0;
  lit.count = 0;
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j)
      for (int i = 0; i < g.nx - 1; ++i, ++voxel) {
        bool any = false;
        for (int c = 0; c < 8; ++c) {
          const float* rgb = &volume.emission[3 * g.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))];
          any = any || rgb[0] > 0 || rgb[1] > 0 || rgb[2] > 0;
        }
        lit.inside[voxel] = any ? 1 : 0;
        lit.count += any ? 1 : 0;
      }
  return lit;
}

/// A flame's box and what is dark around it, where splats must not shine.
recon::PixelBox grown(const recon::FlameMask& mask) {
  const int margin = std::max(2, mask.size.width / 40);
  return {std::max(0, mask.box.x0 - margin), std::max(0, mask.box.y0 - margin),
          std::min(mask.size.width, mask.box.x1 + margin), std::min(mask.size.height, mask.box.y1 + margin)};
}

/// Pixels that a voxel edge covers in the middle of the grid, rounded.
int pixels_of_an_edge(const recon::View& view, const recon::Scene& scene, const recon::Grid& grid) {
  const auto edge = static_cast<double>(grid.edge);
  const double away = std::max(edge, (view.camera.camera_from_world * scene.box.center).norm());
  return static_cast<int>(std::lround(std::clamp(view.camera.intrinsics.fx * edge / away, 1.0, 8.0)));
}

/// Of kind not_converged where a result isn't finite, or shows the input views no better than darkness.
Status check_shown(const TomographyInput& input, const MethodResult& result, int threads) {
  const std::vector<float>& emission = result.volume.emission;
  bool good = std::all_of(emission.begin(), emission.end(), [](float v) { return std::isfinite(v); });
  recon::RenderOptions render;
  render.compute = {recon::Device::cpu, threads};
  double off = 0;
  double dark = 0;
  for (const recon::View* view : input.views) {
    if (!good) break;
    const recon::RadianceImage shown =
        recon::render_view(result.volume, result.medium, result.effects, view->camera, render);
    off += std::pow(recon::all_channels(recon::rmse(*view, shown, {})), 2);
    dark += std::pow(recon::all_channels(recon::rmse(*view, recon::RadianceImage(shown.size), {})), 2);
  }
  good = good && off < dark;
  if (good) return {};
  return Error{ErrorKind::not_converged, "the input views are shown no better than by no light at all",
               "splats", "Check the cameras' poses and the box; try fewer voxels"};
}

}  // namespace

recon::Volume on_key_points(const Splats& splats, const recon::Grid& grid, recon::Pool& pool) {
  std::vector<Reach> reaches;
  reaches.reserve(splats.all.size());
  for (const Splat& splat : splats.all) reaches.emplace_back(splat, grid);
  std::vector<std::array<float, 3>> light(splats.all.size());
  constexpr int kTasks = 64;
  pool.run(kTasks, [&](int task) {
    const recon::Slice mine = recon::slice(splats.all.size(), kTasks, task);
    for (std::size_t s = mine.begin; s < mine.end; ++s) {
      light[s] = light_of(splats.all[s], splats.unit);
      const float scale = correction(splats.all[s], reaches[s], grid) / grid.edge;
      for (float& channel : light[s]) channel *= scale;
    }
  });
  recon::Volume volume{grid, std::vector<float>(3 * grid.size()), {}};
  pool.run(grid.nz, [&](int k) {
    for (std::size_t s = 0; s < reaches.size(); ++s) {
      const Reach& reach = reaches[s];
      if (k < reach.low[2] || k > reach.high[2]) continue;
      for (int j = reach.low[1]; j <= reach.high[1]; ++j)
        for (int i = reach.low[0]; i <= reach.high[0]; ++i) {
          const float value = reach.at(i, j, k);
          float* rgb = &volume.emission[3 * grid.index(i, j, k)];
          for (std::size_t c = 0; c < 3; ++c) rgb[c] += value * light[s][c];
        }
    }
  });
  return volume;
}

Result<MethodResult> gaussian_splats(const recon::Scene& scene, const MethodOptions& options) {
  EMBERLOCK_ASSIGN_OR_RETURN(const TomographyInput input, find_input(scene, options, 1));
  const recon::Grid& grid = input.hull.grid;
  recon::Pool pool(options.compute.threads, recon::Device::cpu);
  std::vector<SplatView> views(input.views.size());
  pool.run(static_cast<int>(views.size()), [&](int task) {
    const auto v = static_cast<std::size_t>(task);
    const recon::View& view = *input.views[v];
    views[v] =
        splat_view(view, grown(recon::noise_mask(*view.image)), grid, pixels_of_an_edge(view, scene, grid));
  });
  SplatFitOptions fit_options;
  fit_options.seed = options.seed;
  fit_options.stop = options.stop;
  SplatFit fit = fit_splats(input.hull, views, fit_options, pool);
  MethodResult result;
  result.volume = on_key_points(fit.splats, grid, pool);
  result.medium = lit_voxels(result.volume);
  result.iterations = fit.iterations;
  EMBERLOCK_RETURN_IF_ERROR(check_shown(input, result, options.compute.threads));
  return result;
}

}  // namespace emberlock::paper
