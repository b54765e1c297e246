// SPDX-License-Identifier: Apache-2.0
#include "apply/ray_light.h"

#include <cmath>

#include <gtest/gtest.h>

namespace emberlock::apply {
namespace {

void add(RayLight& light, float from, float to, float source, float sigma) {
  light.steps().push_back({from, to, recon::Rgba{{source, 2 * source, 0, sigma}}});
}

/// The radiance of an even stretch, by Beer and Lambert.
double shine(double source, double sigma, double length) {
  return sigma > 0 ? source / sigma * -std::expm1(-sigma * length) : source * length;
}

TEST(RayLight, NothingLetsEverythingThrough) {
  RayLight light;
  light.merge();
  EXPECT_EQ(light.all().c[0], 0);
  EXPECT_EQ(light.all().c[3], 1);
  EXPECT_EQ(light.up_to(3).c[3], 1);
}

TEST(RayLight, AStretchThatIsCutShinesAsItsPart) {
  RayLight light;
  add(light, 1, 2, 100, 0.5F);
  add(light, 2, 3, 50, 2);
  light.end_flame();
  light.merge();
  EXPECT_EQ(light.up_to(0.5F).c[0], 0);
  EXPECT_NEAR(static_cast<double>(light.up_to(1.25F).c[0]), shine(100, 0.5, 0.25), 1e-4);
  const double through = std::exp(-0.5);
  EXPECT_NEAR(static_cast<double>(light.up_to(2.5F).c[1]),
              2 * (shine(100, 0.5, 1) + through * shine(50, 2, 0.5)), 1e-3);
  EXPECT_NEAR(static_cast<double>(light.up_to(9).c[3]), std::exp(-2.5), 1e-6);
  EXPECT_EQ(light.up_to(9).c[0], light.all().c[0]);
}

/// [1, 3] and [2, 4] overlap in [2, 3], where both emit and absorb; in whichever order they come.
TEST(RayLight, FlamesThatOverlapAddUpWhereTheyDo) {
  const double expected =
      shine(10, 0.5, 1) + std::exp(-0.5) * shine(10 + 4, 0.5 + 1, 1) + std::exp(-2.0) * shine(4, 1, 1);
  for (const bool swapped : {false, true}) {
    RayLight light;
    for (const bool second : {swapped, !swapped}) {
      if (second)
        add(light, 2, 4, 4, 1);
      else
        add(light, 1, 3, 10, 0.5F);
      light.end_flame();
    }
    light.merge();
    EXPECT_NEAR(static_cast<double>(light.all().c[0]), expected, 1e-4);
    EXPECT_NEAR(static_cast<double>(light.all().c[3]), std::exp(-3.0), 1e-6);
    EXPECT_NEAR(static_cast<double>(light.up_to(2).c[0]), shine(10, 0.5, 1), 1e-4);
  }
}

TEST(RayLight, AGapBetweenTwoFlamesIsClear) {
  RayLight light;
  add(light, 5, 6, 8, 1);
  light.end_flame();
  add(light, 1, 2, 4, 1);
  light.end_flame();
  light.merge();
  EXPECT_NEAR(static_cast<double>(light.up_to(4).c[0]), shine(4, 1, 1), 1e-5);
  EXPECT_NEAR(static_cast<double>(light.all().c[0]), shine(4, 1, 1) + std::exp(-1.0) * shine(8, 1, 1), 1e-5);
}

}  // namespace
}  // namespace emberlock::apply
