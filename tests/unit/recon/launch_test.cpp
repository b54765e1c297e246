// SPDX-License-Identifier: Apache-2.0
// What a GPU runs one thread for each call, called here one after the other and backwards: every call has its
// own place to write to, and together they do what the CPU's own way does.
#include <algorithm>
#include <tuple>

#include <gtest/gtest.h>

#include "recon/calibrate/camera_model.h"
#include "recon/hull/hull.h"
#include "recon/hull/kernel_views.h"
#include "recon/hull/ray_list_cuda.h"
#include "recon/kernels/field.h"
#include "recon/kernels/gather.h"
#include "recon/kernels/paper.h"
#include "tests/support/march_case.h"
#include "tests/support/ring_scene.h"

namespace emberlock::recon {
namespace {

template <class Act>
void launch(std::size_t count, const Act& act) {
  for (std::size_t i = count; i-- > 0;) act(i);
}

/// What sort_by_voxel() makes on the GPU.
struct Sorted {
  std::vector<std::uint32_t> order, begin;
  [[nodiscard]] SamplesByVoxel view() const { return {order.data(), begin.data()}; }
};

template <class Path>
Sorted sort_samples(const RayList& list) {
  std::vector<std::uint32_t> voxels(list.first_sample(list.rays.size()));
  launch(list.runs.size(), NameVoxels<float, Path>{list.table(), voxels.data(), 0});
  Sorted sorted{std::vector<std::uint32_t>(voxels.size()), std::vector<std::uint32_t>(list.grid.size() + 1)};
  launch(voxels.size(), Number{sorted.order.data()});
  std::stable_sort(sorted.order.begin(), sorted.order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return voxels[a] < voxels[b]; });
  std::vector<std::uint32_t> in_order(voxels.size());
  for (std::size_t i = 0; i < in_order.size(); ++i) in_order[i] = voxels[sorted.order[i]];
  launch(sorted.begin.size(),
         FindBegin{in_order.data(), static_cast<std::uint32_t>(in_order.size()), sorted.begin.data()});
  return sorted;
}

/// Sums in another order, so up to rounding.
void expect_near(const std::vector<Rgba>& found, const std::vector<Rgba>& expected) {
  float most = 0;
  for (const Rgba& v : expected)
    for (int c = 0; c < 4; ++c) most = std::max(most, std::abs(v.c[c]));
  ASSERT_GT(most, 0);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t p = 0; p < found.size(); ++p)
    for (int c = 0; c < 4; ++c) ASSERT_NEAR(found[p].c[c], expected[p].c[c], 2e-6F * most) << p << ", " << c;
}

template <class Path>
void expect_gathered(const RayList& list) {
  const Sorted sorted = sort_samples<Path>(list);
  const auto residual = random_quads<float>(list.rays.size(), 6);
  std::vector<Deposit<float>> deposits(sorted.order.size());
  const LayAside<float> aside{deposits.data(), 0};
  std::vector<Rgba> gradient(list.grid.size());
  const auto gather = [&](const auto& spread) {
    using Spread = std::decay_t<decltype(spread)>;
    std::fill(gradient.begin(), gradient.end(), Rgba{});
    launch(gradient.size(), GatherDeposits<float, Spread>{list.grid.nx, list.grid.ny, sorted.view(),
                                                          deposits.data(), gradient.data(), spread});
  };

  const Marcher<float> march(list);
  const ConstantExtinction<float> extinction{0.1F};
  launch(list.runs.size(), emberlock::recon::Adjoint<float, ConstantExtinction<float>, Path, LayAside<float>>{
                               list.table(), residual.data(), extinction, aside});
  gather(Trilinear{});
  expect_near(gradient, march.adjoint(Absorb::constant, residual, 0.1F));

  const std::vector<Rgba> black(list.rays.size());
  const auto field = march.field_forward(random_quads<float>(list.grid.size(), 5, 1, 0.2),
                                         PixelResidual<float>{black.data(), nullptr, nullptr, 0});
  launch(list.runs.size(), FieldAdjoint<float, Path, LayAside<float>>{list.table(), field.residual.data(),
                                                                      field.samples.data(), 0, aside});
  gather(Trilinear{});
  expect_near(gradient, march.field_adjoint(field));

  launch(list.runs.size(), PaperAdjust<ConstantExtinction<float>, LayAside<float>>{
                               list.table(), residual.data(), extinction, 0.001F, 0.05F, 7, aside});
  gather(Fade{1.5F});
  std::vector<Rgba> adjusted(list.grid.size());
  const PaperAdjust<ConstantExtinction<float>> adjust{
      list.table(), residual.data(), extinction, 0.001F, 0.05F, 7, {list.table(), adjusted.data(), {1.5F}}};
  launch(list.runs.size(), adjust);
  expect_near(gradient, adjusted);
}

TEST(Launch, KeyPointsGatherWhatSamplesWouldAdd) { expect_gathered<StraightPath>(march_case().list); }

TEST(Launch, VoxelsCarvedOneByOneAreTheHull) {
  const Scene scene = ring_scene();
  const std::vector<FlameMask> masks = flame_masks(scene);
  const Grid grid = grid_over(scene.box, 37);  // no multiple of the largest cubes
  const auto expected = carve(scene, masks, grid, {Device::cpu, 1});
  ASSERT_TRUE(expected.ok());

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
  std::vector<std::uint8_t> inside(expected->inside.size());
  launch(inside.size(), CarveVoxel{{{grid}, views.data(), static_cast<int>(views.size())}, inside.data()});
  EXPECT_EQ(inside, expected->inside);
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
