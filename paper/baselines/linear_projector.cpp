// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/linear_projector.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "recon/adjust/descent.h"
#include "recon/adjust/tracker.h"
#include "recon/views/check_scene.h"
#include "recon/views/flame_mask.h"

namespace emberlock::paper {
namespace {

constexpr int kSums = 64;  // a sum's parts, whatever the number of threads

recon::Problem linear_problem(const std::vector<const recon::View*>& views, const recon::Hull& hull,
                              int stride, const recon::RefractiveIndex* gas, recon::Pool& pool) {
  recon::ProblemOptions options;
  options.gas = gas;
  options.rule.stride = stride;
  return recon::make_problem(views, hull, options, pool);
}

}  // namespace

Result<TomographyInput> find_input(const recon::Scene& scene, const MethodOptions& options,
                                   std::size_t fewest) {
  EMBERLOCK_RETURN_IF_ERROR(recon::check_scene(scene));
  if (options.voxels < 8 || options.voxels > 256)
    return Error{ErrorKind::bad_input, std::to_string(options.voxels) + " is out of range", "voxels",
                 "Give 8 to 256"};
  if (options.compute.threads < 0 || options.compute.threads > 256)
    return Error{ErrorKind::bad_input, "the number of threads is out of range", "threads",
                 "Give 1 to 256, or 0 for every core"};
  TomographyInput input;
  for (const recon::View& view : scene.views)
    if (view.role == recon::ViewRole::input) input.views.push_back(&view);
  if (input.views.size() < fewest)
    return Error{ErrorKind::bad_input,
                 fmt::format("{} input view, where {} are needed", input.views.size(), fewest), "scene",
                 "Give more views that aren't held out"};
  const recon::ComputeOptions compute{recon::Device::cpu, options.compute.threads};
  EMBERLOCK_ASSIGN_OR_RETURN(input.hull, recon::carve(scene, recon::flame_masks(scene, std::nullopt, compute),
                                                      recon::grid_over(scene.box, options.voxels), compute));
  return input;
}

TomographyInput coarse_input(TomographyInput input, int most_voxels) {
  input.hull = recon::coarsen_to(input.hull, most_voxels);
  return input;
}

int stride_for(const TomographyInput& input) {
  constexpr double kPixelsPerVoxel = 1.4;
  const recon::Grid& g = input.hull.grid;
  const double half[3] = {0.5 * (g.nx - 1), 0.5 * (g.ny - 1), 0.5 * (g.nz - 1)};
  double least = std::numeric_limits<double>::infinity();
  for (const recon::View* view : input.views) {
    double square = 0;
    for (int a = 0; a < 3; ++a) {
      const double middle = static_cast<double>(g.origin[a]) + static_cast<double>(g.edge) * half[a];
      square += std::pow(view->camera.center()[a] - middle, 2);
    }
    const double distance = std::max(std::sqrt(square), static_cast<double>(g.edge));
    least = std::min(least, std::abs(view->camera.intrinsics.fx) * static_cast<double>(g.edge) / distance);
  }
  return std::max(1, static_cast<int>(std::min(64.0, least / kPixelsPerVoxel)));
}

LinearProjector::LinearProjector(const std::vector<const recon::View*>& views, const recon::Hull& hull,
                                 int stride, recon::Pool& pool, const recon::RefractiveIndex* gas)
    : hull_(hull),
      pool_(pool),
      problem_(linear_problem(views, hull, stride, gas, pool)),
      seen_(problem_.seen) {
  for (recon::Rgba& pixel : seen_) pixel.c[3] = 0;  // whether it was saturated, which is passed over
}

void LinearProjector::project(const Light& x, Light& y) const {
  y.resize(rays());
  recon::MarchWork<float> work;
  work.rays = problem_.list.table();
  work.volume = x.data();
  work.residual = y.data();
  const auto march = recon::march_table<float>().forward_of(recon::Absorb::nothing, travel());
  constexpr int kTasks = 64;
  pool_.run(kTasks, [&](int task) {
    const recon::Slice mine = recon::slice(rays(), kTasks, task);
    march(work, mine.begin, mine.end);
    for (std::size_t r = mine.begin; r < mine.end; ++r) y[r].c[3] = 0;  // the transmittance
  });
}

void LinearProjector::back_project(const Light& y, Light& x) const {
  x.assign(grid().size(), recon::Rgba{});
  recon::MarchWork<float> work;
  work.rays = problem_.list.table();
  work.residual = const_cast<recon::Rgba*>(y.data());  // NOLINT(*-const-cast): the transpose only reads it
  work.gradient = x.data();
  const auto march = recon::march_table<float>().adjoint_of(recon::Absorb::nothing, travel());
  const recon::SlabRuns& slabs = problem_.slabs.front();
  // Even slabs, then odd ones: no two that are written at the same time share a key point.
  for (int parity = 0; parity < 2; ++parity) {
    pool_.run((problem_.slab_count() + 1 - parity) / 2, [&](int task) {
      const auto slab = 2 * static_cast<std::size_t>(task) + static_cast<std::size_t>(parity);
      const std::size_t count = slabs.begin[slab + 1] - slabs.begin[slab];
      if (count > 0) march(work, &slabs.run[slabs.begin[slab]], count);
    });
  }
}

recon::Volume LinearProjector::volume(const Light& x) const {
  return recon::to_volume(x, problem_, hull_, recon::Effects{});
}

Channels squares_left(const LinearMap& map, const Light& x) {
  Light y;
  map.project(x, y);
  combine(y, {-1, -1, -1}, map.seen(), y, map.pool());
  return dot(y, y, map.pool());
}

Channels dot(const Light& a, const Light& b, recon::Pool& pool) {
  std::vector<Channels> sums(kSums, Channels{});
  pool.run(kSums, [&](int task) {
    Channels& sum = sums[static_cast<std::size_t>(task)];
    const recon::Slice mine = recon::slice(a.size(), kSums, task);
    for (std::size_t i = mine.begin; i < mine.end; ++i)
      for (std::size_t c = 0; c < 3; ++c)
        sum[c] += static_cast<double>(a[i].c[c]) * static_cast<double>(b[i].c[c]);
  });
  Channels total = {};
  for (const Channels& sum : sums)
    for (std::size_t c = 0; c < 3; ++c) total[c] += sum[c];
  return total;
}

void combine(const Light& a, const Channels& s, const Light& b, Light& to, recon::Pool& pool) {
  const recon::Rgba scale = {
      {static_cast<float>(s[0]), static_cast<float>(s[1]), static_cast<float>(s[2]), 0}};
  to.resize(a.size());
  each_of(a.size(), pool, [&](std::size_t i) { to[i].c = a[i].c + scale.c * b[i].c; });
}

Result<MethodResult> conclude(const TomographyInput& input, const LinearProjector& projector, const Light& x,
                              int iterations) {
  const auto refuse = [](std::string what) {
    return Error{ErrorKind::not_converged, std::move(what), "tomography",
                 "Check the cameras' poses and the box; try fewer voxels"};
  };
  MethodResult result{projector.volume(x), input.hull, {}, iterations};
  const std::vector<float>& emission = result.volume.emission;
  if (!std::all_of(emission.begin(), emission.end(), [](float v) { return std::isfinite(v); }))
    return refuse("the volume holds numbers that aren't finite");
  const double dark = sum_of(dot(projector.seen(), projector.seen(), projector.pool()));
  if (!(sum_of(squares_left(projector, x)) < dark))
    return refuse("the input views are shown no better than by no light at all");
  return result;
}

}  // namespace emberlock::paper
