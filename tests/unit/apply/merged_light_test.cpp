// SPDX-License-Identifier: Apache-2.0
#include "apply/kernels/merged_light.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace emberlock::apply {
namespace {

/// A row of steps that is told one by one.
struct Row {
  std::vector<RayStep> steps;
  std::size_t at = 0;
  bool next(RayStep& step) {
    if (at == steps.size()) return false;
    step = steps[at++];
    return true;
  }
};
RayStep shining(float from, float to, float source, float sigma) {
  return {from, to, recon::Rgba{{source, 2 * source, 0, sigma}}};
}
recon::Rgba up_to(const std::vector<Row>& flames, float distance) {
  MergedLight<Row, 4> merged;
  for (const Row& flame : flames) merged.add(flame);
  recon::Rgba light;
  merged.up_to(&distance, 1, &light);
  return light;
}
constexpr float kBeyond = 3e38F;

/// The radiance of an even stretch, by Beer and Lambert.
double shine(double source, double sigma, double length) {
  return sigma > 0 ? source / sigma * -std::expm1(-sigma * length) : source * length;
}

TEST(MergedLight, NothingLetsEverythingThrough) {
  for (const float distance : {3.F, kBeyond}) {
    EXPECT_EQ(up_to({}, distance).c[0], 0);
    EXPECT_EQ(up_to({}, distance).c[3], 1);
    EXPECT_EQ(up_to({{}}, distance).c[3], 1);
  }
}

TEST(MergedLight, AStretchThatIsCutShinesAsItsPart) {
  const std::vector<Row> flame{{{shining(1, 2, 100, 0.5F), shining(2, 3, 50, 2)}}};
  EXPECT_EQ(up_to(flame, 0.5F).c[0], 0);
  EXPECT_NEAR(static_cast<double>(up_to(flame, 1.25F).c[0]), shine(100, 0.5, 0.25), 1e-4);
  const double through = std::exp(-0.5);
  EXPECT_NEAR(static_cast<double>(up_to(flame, 2.5F).c[1]),
              2 * (shine(100, 0.5, 1) + through * shine(50, 2, 0.5)), 1e-3);
  EXPECT_NEAR(static_cast<double>(up_to(flame, 9).c[3]), std::exp(-2.5), 1e-6);
  EXPECT_EQ(up_to(flame, 9).c[0], up_to(flame, kBeyond).c[0]);
}

TEST(MergedLight, AscendingDistancesAreTakenInOneMarch) {
  const std::vector<Row> flames{{{shining(1, 2, 100, 0.5F), shining(2, 3, 50, 2)}},
                                {{shining(1.5F, 4, 7, 0.1F)}}};
  MergedLight<Row, 4> merged;
  for (const Row& flame : flames) merged.add(flame);
  const float distances[] = {0.5F, 1.2F, 1.2F, 1.5F, 2, 2.7F, 5, kBeyond};
  recon::Rgba light[8];
  merged.up_to(distances, 8, light);
  for (int i = 0; i < 8; ++i)
    for (int c = 0; c < 4; ++c) EXPECT_EQ(light[i].c[c], up_to(flames, distances[i]).c[c]) << i;
}

/// [1, 3] and [2, 4] overlap in [2, 3], where both emit and absorb; in whichever order they come.
TEST(MergedLight, FlamesThatOverlapAddUpWhereTheyDo) {
  const double expected =
      shine(10, 0.5, 1) + std::exp(-0.5) * shine(10 + 4, 0.5 + 1, 1) + std::exp(-2.0) * shine(4, 1, 1);
  const Row one{{shining(1, 3, 10, 0.5F)}};
  const Row other{{shining(2, 4, 4, 1)}};
  for (const auto& flames : {std::vector<Row>{one, other}, {other, one}}) {
    EXPECT_NEAR(static_cast<double>(up_to(flames, kBeyond).c[0]), expected, 1e-4);
    EXPECT_NEAR(static_cast<double>(up_to(flames, kBeyond).c[3]), std::exp(-3.0), 1e-6);
    EXPECT_NEAR(static_cast<double>(up_to(flames, 2).c[0]), shine(10, 0.5, 1), 1e-4);
  }
}

TEST(MergedLight, AGapBetweenTwoFlamesIsClear) {
  const std::vector<Row> flames{{{shining(5, 6, 8, 1)}}, {{shining(1, 2, 4, 1)}}};
  EXPECT_NEAR(static_cast<double>(up_to(flames, 4).c[0]), shine(4, 1, 1), 1e-5);
  EXPECT_NEAR(static_cast<double>(up_to(flames, kBeyond).c[0]),
              shine(4, 1, 1) + std::exp(-1.0) * shine(8, 1, 1), 1e-5);
}

}  // namespace
}  // namespace emberlock::apply
