#include "recon/effects/effects.h"

#include <gtest/gtest.h>

#include "recon/adjust/choose_effects.h"
#include "tests/support/small_flame.h"

namespace emberlock {
namespace {

EffectChoice found(const Scene& scene) {
  SolveOptions options;
  options.compute.device = Device::cpu;
  auto choice = choose_effects(scene, grid_over(scene.box, 64), {}, options);
  EXPECT_TRUE(choice.ok());
  return *choice;
}

TEST(Effects, EmissionOnlyFlameIsFoundAsSuch) {
  for (const FlameShape shape : {FlameShape::plume, FlameShape::two_plumes}) {
    const EffectChoice choice = found(small_flame_scene(PerMeter(0), shape));
    ASSERT_EQ(choice.reports.size(), 1u);
    EXPECT_FALSE(choice.reports[0].on) << choice.reports[0].reason;
    EXPECT_EQ(choice.effects.extinction.value, PerMeter(0));
  }
}

TEST(Effects, ConstantExtinctionIsFoundWithinAFactorOfTwo) {
  for (const FlameShape shape : {FlameShape::plume, FlameShape::two_plumes}) {
    const EffectChoice choice = found(small_flame_scene(PerMeter(32.8), shape));
    EXPECT_TRUE(choice.reports[0].on);
    EXPECT_GT(choice.reports[0].predicted_change, 2);
    // The hull is larger than the medium, so the extinction that fits best is less than the truth.
    EXPECT_GT(choice.effects.extinction.value.value(), 14);
    EXPECT_LT(choice.effects.extinction.value.value(), 45);
  }
}

TEST(Effects, SetByHandIsTakenAndItsChangePredicted) {
  const Scene scene = small_flame_scene();
  const auto request = parse_effects("extinction=32.8");
  ASSERT_TRUE(request.ok());
  SolveOptions options;
  options.compute.device = Device::cpu;
  const auto choice = choose_effects(scene, grid_over(scene.box, 64), *request, options);
  ASSERT_TRUE(choice.ok());
  EXPECT_EQ(choice->effects.extinction.value, PerMeter(32.8));
  EXPECT_GT(choice->reports[0].predicted_change, 2);
  EXPECT_EQ(choice->reports[0].reason, "set by hand");
}

TEST(Effects, ListsAreParsedAndBadOnesRefused) {
  EXPECT_FALSE(parse_effects("auto")->fixed.has_value());
  EXPECT_EQ(parse_effects("none")->fixed->extinction.value, PerMeter(0));
  for (const char* bad :
       {"", "extinction", "extinction=", "extinction=-1", "extinction=nan", "extinction=1e999",
        "extinction=3x", "fog=3", "extinction=1,extinction=2", "extinction=1,"}) {
    const auto request = parse_effects(bad);
    ASSERT_FALSE(request.ok()) << bad;
    EXPECT_EQ(request.error().where, "effects");
  }
}

TEST(Effects, ThePapersOpacityAsExtinction) {
  EXPECT_NEAR(extinction_of_opacity(0.05, Meters(0.2 / 128)).value(), 32.83, 0.01);
}

}  // namespace
}  // namespace emberlock
