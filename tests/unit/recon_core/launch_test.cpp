// SPDX-License-Identifier: Apache-2.0
// What a GPU runs one thread for each call, called here one after the other and backwards: every call has its
// own place to write to, and together they do what the CPU's own way does.
#include <algorithm>
#include <iterator>
#include <numeric>
#include <tuple>
#include <type_traits>

#include <gtest/gtest.h>

#include "recon/hull/hull.h"
#include "recon/hull/kernel_views.h"
#include "recon/hull/ray_list_cuda.h"
#include "recon/kernels/field.h"
#include "recon/kernels/gather.h"
#include "recon/kernels/paper.h"
#include "recon/views/camera_model.h"
#include "tests/support/march_case.h"
#include "tests/support/results.h"
#include "tests/support/ring_scene.h"

namespace emberlock::recon {
namespace {

template <class Act>
void launch(std::size_t count, const Act& act) {
  for (std::size_t i = count; i-- > 0;) act(i);
}

/// What sort_by_voxel() makes on the GPU, of the samples from `first_ray` to `last_ray`.
struct Sorted {
  std::size_t first = 0;
  std::vector<std::uint32_t> run, order, begin, place;
  [[nodiscard]] SamplesByVoxel view() const {
    return {order.data(), begin.data(), place.data(), begin.size() - 1};
  }
};

std::size_t first_run(const RayList& list, std::size_t ray) {
  return ray < list.rays.size() ? list.rays[ray].first_run : list.runs.size();
}
std::size_t first_sample(const RayList& list, std::size_t ray) {
  const std::size_t run = first_run(list, ray);
  return run < list.runs.size() ? list.runs[run].first_sample : list.count().samples;
}

template <class Real, class Path>
Sorted sort_samples(const RayList& list, std::size_t first_ray, std::size_t last_ray) {
  const std::size_t first = first_sample(list, first_ray);
  const std::size_t count = first_sample(list, last_ray) - first;
  const std::size_t key_points = list.grid.size();
  Sorted sorted{first,
                std::vector<std::uint32_t>(count),
                std::vector<std::uint32_t>(count),
                {},
                std::vector<std::uint32_t>(key_points + 1)};
  std::vector<std::uint32_t> voxels(count);
  const NameVoxels<Real, Path> name{{list.table(), first, sorted.run.data()}, voxels.data()};
  for (std::size_t n = first_run(list, last_ray); n-- > first_run(list, first_ray);) name(n);
  launch(count, Number{sorted.order.data()});
  std::stable_sort(sorted.order.begin(), sorted.order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return voxels[a] < voxels[b]; });
  std::vector<std::uint32_t> in_order(count);
  for (std::size_t i = 0; i < count; ++i) in_order[i] = voxels[sorted.order[i]];
  std::vector<std::uint32_t> begin(key_points + 1);
  launch(begin.size(), FindBegin<>{in_order.data(), static_cast<std::uint32_t>(count), begin.data()});
  launch(key_points, HasSamples{begin.data(), sorted.place.data()});
  std::exclusive_scan(sorted.place.begin(), sorted.place.end(), sorted.place.begin(), 0U);
  sorted.begin.resize(sorted.place.back() + std::size_t{1});
  launch(begin.size(), ListBegin{begin.data(), sorted.place.data(), key_points, sorted.begin.data()});
  EXPECT_EQ(sorted.begin.back(), count);
  std::sort(voxels.begin(), voxels.end());
  voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
  EXPECT_EQ(sorted.view().voxels, voxels.size());
  return sorted;
}

template <class Real, class Path, class Weight, class Spread = Trilinear>
std::vector<Quad<Real>> gathered(const RayList& list, const Sorted& sorted, const Weight& weight,
                                 const Spread& spread = {}) {
  std::vector<std::uint32_t> run = sorted.run;
  std::vector<Deposit<Real>> deposits(run.size());
  const LayAside<Real, Path, Weight> aside{{list.table(), sorted.first, run.data()}, weight, deposits.data()};
  for (std::size_t s = sorted.first + run.size(); s-- > sorted.first;) aside(s);
  const SamplesByVoxel samples = sorted.view();
  std::vector<Quad<Real>> sums(8 * samples.voxels);
  launch(samples.voxels, SumCorners<Real, Spread>{samples, deposits.data(), sums.data(), spread});
  std::vector<Quad<Real>> target(list.grid.size());
  launch(target.size(), AddCorners<Real>{list.grid.nx, list.grid.ny, samples, sums.data(), target.data()});
  return target;
}

/// Sums in another order, so up to rounding.
template <class Real>
void expect_near(const std::vector<Quad<Real>>& found, const std::vector<Quad<Real>>& expected) {
  Real most = 0;
  for (const Quad<Real>& v : expected)
    for (int c = 0; c < 4; ++c) most = std::max(most, std::abs(v.c[c]));
  ASSERT_GT(most, 0);
  ASSERT_EQ(found.size(), expected.size());
  const Real rounding = std::is_same_v<Real, float> ? Real(5e-6) : Real(1e-12);
  for (std::size_t p = 0; p < found.size(); ++p)
    for (int c = 0; c < 4; ++c)
      ASSERT_NEAR(found[p].c[c], expected[p].c[c], rounding * most) << p << ", " << c;
}

template <class Real, class Path>
void expect_gathered(const RayList& list) {
  const Sorted sorted = sort_samples<Real, Path>(list, 0, list.rays.size());
  const auto residual = random_quads<Real>(list.rays.size(), 6);
  const Marcher<Real> march(list);
  const ConstantExtinction<Real> thick{Real(1.7)};  // a step of 1.7: not that of exp(-sigma ds)
  expect_near(gathered<Real, Path>(list, sorted,
                                   AdjointWeight<Real, ConstantExtinction<Real>>{residual.data(), thick}),
              march.adjoint(Absorb::constant, residual, thick.sigma));
  expect_near(
      gathered<Real, Path>(list, sorted, AdjointWeight<Real, NoExtinction<Real>>{residual.data(), {}}),
      march.adjoint(Absorb::nothing, residual, 0));

  const std::vector<Rgba> black(list.rays.size());
  const auto field = march.field_forward(random_quads<Real>(list.grid.size(), 5, 1, 0.2),
                                         PixelResidual<Real>{black.data(), nullptr, nullptr, 0});
  expect_near(
      gathered<Real, Path>(list, sorted, FieldWeight<Real>{field.residual.data(), field.samples.data(), 0}),
      march.field_adjoint(field));
}

template <class Real>
void expect_gathered_everywhere() {
  expect_gathered<Real, StraightPath>(march_case().list);
  expect_gathered<Real, StraightPath>(march_case({.step = 0.3F, .seed = 2}).list);
  expect_gathered<Real, StraightPath>(march_case({.size = {0.2, 0.01, 0.01}, .filled = 1}).list);
  expect_gathered<Real, StraightPath>(march_case({.size = {0.01, 0.2, 0.01}, .filled = 1}).list);
  expect_gathered<Real, StraightPath>(march_case({.size = {0.01, 0.01, 0.2}, .filled = 1}).list);
  expect_gathered<Real, CurvedPath>(march_case({.curved = true}).list);
}

TEST(Launch, KeyPointsAddUpWhatSamplesWouldAdd) {
  expect_gathered_everywhere<float>();
  expect_gathered_everywhere<double>();
}

TEST(Launch, ThePapersKeyPointsAddUpWhatSamplesWouldAdd) {
  const RayList list = march_case().list;
  const auto residual = random_quads<float>(list.rays.size(), 6);
  const ConstantExtinction<float> extinction{0.1F};
  const PaperChange change{0.001F, 0.05F, 7};
  const Fade fade{1.5F};
  std::vector<Rgba> adjusted(list.grid.size());
  launch(list.runs.size(),
         PaperAdjust<ConstantExtinction<float>>{
             list.table(), residual.data(), extinction, change, {list.table(), adjusted.data(), fade}});
  expect_near(gathered<float, StraightPath>(
                  list, sort_samples<float, StraightPath>(list, 0, list.rays.size()),
                  PaperWeight<ConstantExtinction<float>>{residual.data(), extinction, change}, fade),
              adjusted);
}

/// Subsets have their own samples, and one may have none.
TEST(Launch, PartsOfTheRaysAddUpToAll) {
  const RayList list = march_case().list;
  const auto residual = random_quads<double>(list.rays.size(), 6);
  const AdjointWeight<double, NoExtinction<double>> weight{residual.data(), {}};
  std::vector<Rgba64> sum(list.grid.size());
  const std::size_t cuts[] = {0, 1, 1, list.rays.size() / 3, list.rays.size()};
  for (std::size_t n = 0; n + 1 < std::size(cuts); ++n) {
    const Sorted sorted = sort_samples<double, StraightPath>(list, cuts[n], cuts[n + 1]);
    const auto part = gathered<double, StraightPath>(list, sorted, weight);
    for (std::size_t p = 0; p < sum.size(); ++p) sum[p] = sum[p] + part[p];
  }
  expect_near(sum, Marcher<double>(list).adjoint(Absorb::nothing, residual, 0));
}

TEST(Launch, VoxelsCarvedOneByOneAreTheHull) {
  const Scene scene = ring_scene();
  const std::vector<FlameMask> masks = flame_masks(scene);
  const Grid grid = grid_over(scene.box, 37);  // no multiple of the largest cubes
  const auto expected = value_of(carve(scene, masks, grid, {Device::cpu, 1}));

  std::vector<FlameTable> tables;
  std::vector<Silhouette> views;
  std::vector<std::vector<std::uint32_t>> sums(scene.views.size());
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].role != ViewRole::input) continue;
    const auto [width, height] = masks[v].size;
    sums[v].resize(static_cast<std::size_t>((width + 1) * (height + 1)));
    tables.push_back({masks[v].flame.data(), sums[v].data(), width, height});
    views.push_back(silhouette(scene.views[v].camera));
    views.back().flame_pixels = sums[v].data();
  }
  const auto width = static_cast<std::size_t>(masks[0].size.width) + 1;
  const auto height = static_cast<std::size_t>(masks[0].size.height);
  launch(height * tables.size(), SumAlongRow{tables.data(), height});
  launch(width * tables.size(), SumDownColumns{tables.data(), width, 1});
  std::vector<std::uint8_t> inside(expected.inside.size());
  launch(inside.size(), CarveVoxel{{{grid}, views.data(), static_cast<int>(views.size())}, inside.data()});
  EXPECT_EQ(inside, expected.inside);
}

void expect_cut(bool curved) {
  const MarchCase c = march_case();
  const RefractiveIndex lens = lens_of_gas();
  const IndexField gas = lens.field(c.medium.grid);
  RayListOptions options;
  options.subsets = 3;
  options.subset_of = [](std::size_t view, int x, int y) { return (x * y + static_cast<int>(view)) % 4 - 1; };
  if (curved) options.gas = &gas;
  Pool pool(2);
  const RayList list = clip_rays({&c.cameras[0], &c.cameras[1]}, c.medium, options, pool);

  const PixelsInOrder in_order =
      pixels_in_order({&c.cameras[0], &c.cameras[1]}, c.medium.grid, options, pool);
  const std::vector<PixelOfView>& pixels = in_order.pixels;
  const Cutter cutter(c.medium, options);
  const PixelRays cameras[] = {pixel_rays(c.cameras[0]), pixel_rays(c.cameras[1])};
  const CutPixels of{cutter.cut(), cameras, list.origins.data(), pixels.data()};
  std::vector<RayCounts> before(pixels.size());
  launch(pixels.size(), CountPixelRuns{of, before.data()});
  RayCounts all;
  for (RayCounts& n : before) {
    const RayCounts here = n;
    n = all;
    all = all + here;
  }
  before.push_back(all);
  for (std::size_t n = 0; n < list.subset_begin.size(); ++n)
    EXPECT_EQ(before[in_order.subset_begin[n]].rays, list.subset_begin[n]);
  ASSERT_EQ(all.rays, list.rays.size());
  ASSERT_EQ(all.runs, list.runs.size());
  std::vector<MarchRay> rays(all.rays);
  std::vector<Run> runs(all.runs);
  std::vector<Bend> bends(all.runs);
  std::vector<std::uint32_t> numbers(all.rays);
  launch(pixels.size(), WritePixelRuns{of, before.data(), rays.data(), runs.data(),
                                       curved ? bends.data() : nullptr, numbers.data()});
  EXPECT_EQ(numbers, list.pixels);
  for (std::size_t r = 0; r < rays.size(); ++r) {
    EXPECT_EQ(rays[r].first_run, list.rays[r].first_run);
    EXPECT_EQ(rays[r].runs, list.rays[r].runs);
    for (int a = 0; a < 3; ++a) EXPECT_EQ(rays[r].direction[a], list.rays[r].direction[a]);
  }
  const float rounding = curved ? 1e-5F : 0;  // GCC 12 rounds its vector code of a path otherwise
  for (std::size_t n = 0; n < runs.size(); ++n) {
    const Run& run = list.runs[n];
    EXPECT_NEAR(runs[n].start, run.start, rounding);
    EXPECT_NEAR(runs[n].before, run.before, rounding);
    EXPECT_NEAR(runs[n].step, run.step, rounding);
    EXPECT_EQ(std::tie(runs[n].ray, runs[n].first_sample, runs[n].count, runs[n].slab),
              std::tie(run.ray, run.first_sample, run.count, run.slab));
    for (int a = 0; curved && a < 3; ++a) {
      EXPECT_NEAR(bends[n].origin[a], list.bends[n].origin[a], rounding);
      EXPECT_NEAR(bends[n].direction[a], list.bends[n].direction[a], rounding);
    }
  }
}

TEST(Launch, StraightRaysAreCutInTwoPassesAsInOne) { expect_cut(false); }
TEST(Launch, CurvedRaysAreCutInTwoPassesAsInOne) { expect_cut(true); }

}  // namespace
}  // namespace emberlock::recon
