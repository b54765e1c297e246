// SPDX-License-Identifier: Apache-2.0
// Rays clipped side by side cross the medium where each alone does, whatever vectors the CPU has.
#include <cmath>

#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <rapidcheck.h>

#include "base/random.h"
#include "recon/hull/clip_bundle.h"
#include "recon/hull/kernel_views.h"

namespace emberlock::recon {
namespace {

Hull some_medium() {
  Grid g;
  g.nx = *rc::gen::inRange(2, 40);
  g.ny = *rc::gen::inRange(2, 40);
  g.nz = *rc::gen::inRange(2, 40);
  Hull medium{g, {}, 0};
  const auto seed = static_cast<std::uint64_t>(*rc::gen::inRange(0, 1'000'000));
  const double filled = *rc::gen::element(0.02, 0.5, 0.95, 1.0);
  const auto voxels = static_cast<std::size_t>((g.nx - 1) * (g.ny - 1) * (g.nz - 1));
  for (std::size_t v = 0; v < voxels; ++v)
    medium.inside.push_back(random_uniform(seed, 1, v / 3) < filled ? 1 : 0);
  return medium;
}

float any(double low, double high) {
  return static_cast<float>(low + (high - low) * *rc::gen::inRange(0, 1 << 20) / (1 << 20));
}

/// From a point inside the box, on a face of it or far off; some rays along an axis or in a plane of two.
RayBundle some_rays(const VoxelMask& mask, float* origin) {
  RayBundle bundle{origin, {}, *rc::gen::inRange(1, RayBundle::kMost + 1)};
  const float size[3] = {static_cast<float>(mask.mx), static_cast<float>(mask.my),
                         static_cast<float>(mask.mz)};
  for (int a = 0; a < 3; ++a) {
    origin[a] = *rc::gen::inRange(0, 4) == 0 ? size[a] : any(-2, 3) * size[a];
  }
  for (std::size_t r = 0; r < static_cast<std::size_t>(bundle.rays); ++r) {
    float d[3];
    for (int a = 0; a < 3; ++a) d[a] = any(0, 1) * size[a] - origin[a];
    if (*rc::gen::inRange(0, 3) == 0) d[*rc::gen::inRange(0, 3)] = 0;
    if (*rc::gen::inRange(0, 6) == 0) d[0] = d[1] = 0;
    const float norm = std::hypot(d[0], d[1], d[2]);
    RC_PRE(norm > 0);
    for (int a = 0; a < 3; ++a) bundle.direction[a][r] = d[a] / norm;
  }
  return bundle;
}

std::vector<float> alone(const Cutter& cutter, const RayBundle& bundle, std::size_t ray) {
  const float direction[3] = {bundle.direction[0][ray], bundle.direction[1][ray], bundle.direction[2][ray]};
  std::vector<float> t;
  clip_to_medium(cutter.cut().voxels, cutter.cut().blocks, bundle.origin, direction,
                 [&](float enter, float leave) {
                   t.insert(t.end(), {enter, leave});
                 });
  return t;
}

class ClipBundleLaw : public testing::TestWithParam<std::int64_t> {
 protected:
  ClipBundleLaw() {
    hwy::SetSupportedTargetsForTest(GetParam());
    hwy::GetChosenTarget().DeInit();
  }
  ~ClipBundleLaw() override {
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().DeInit();
  }
};

TEST_P(ClipBundleLaw, EveryRayCrossesTheMediumWhereItDoesAlone) {
  EXPECT_TRUE(rc::check("the same borders, bit for bit", [] {
    const Hull medium = some_medium();
    const Cutter cutter(medium, {});
    float origin[3];
    const RayBundle bundle = some_rays(cutter.cut().voxels, origin);
    Crossings crossings;
    crossings[0] = {1, 2, 3};  // of an earlier bundle
    clip_bundle(cutter.cut().voxels, cutter.cut().blocks, bundle, crossings);
    bool any_crosses = false;
    for (std::size_t r = 0; r < RayBundle::kMost; ++r) {
      if (r >= static_cast<std::size_t>(bundle.rays)) {
        RC_ASSERT(crossings[r].empty());
        continue;
      }
      RC_ASSERT(crossings[r] == alone(cutter, bundle, r));
      any_crosses = any_crosses || !crossings[r].empty();
    }
    RC_CLASSIFY(any_crosses, "crosses");
  }));
}

INSTANTIATE_TEST_SUITE_P(Vectors, ClipBundleLaw, testing::ValuesIn(hwy::SupportedAndGeneratedTargets()),
                         [](const auto& target) { return hwy::TargetName(target.param); });

}  // namespace
}  // namespace emberlock::recon
