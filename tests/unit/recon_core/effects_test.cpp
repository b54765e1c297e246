// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/effects.h"

#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include <gtest/gtest.h>

#include "recon/adjust/choose_effects.h"
#include "recon/adjust/picture_error.h"
#include "tests/support/devices.h"
#include "tests/support/small_flame.h"
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(EffectsTest);
ON_EACH_DEVICE(EffectsTestSlow);

/// Searched once for all tests of a device.
const EffectChoice& found(PerMeter extinction, FlameShape shape) {
  static std::map<std::tuple<Device, double, FlameShape>, EffectChoice> choices;
  const auto [at, first] = choices.try_emplace({device_here(), extinction.value(), shape});
  if (first) {
    const Scene scene = small_flame_scene(extinction, shape);
    at->second = value_of(choose_effects(scene, grid_over(scene.box, 64), {}, {}));
  }
  return at->second;
}

TEST_P(EffectsTest, EmissionOnlyFlameIsFoundAsSuch) {
  for (const FlameShape shape : {FlameShape::plume, FlameShape::two_plumes}) {
    const EffectChoice& choice = found(PerMeter(0), shape);
    ASSERT_EQ(choice.reports.size(), 10u);
    EXPECT_FALSE(choice.reports[0].on) << choice.reports[0].reason;
    EXPECT_EQ(choice.effects.extinction.value, PerMeter(0));
  }
}

TEST_P(EffectsTestSlow, WhatThePicturesTellBeatsKnowingTheExtinctionButNotWhereItIs) {
  for (const FlameShape shape : {FlameShape::plume, FlameShape::two_plumes}) {
    const Scene scene = small_flame_scene(PerMeter(32.8), shape);
    const auto heldout = [&](const Effects& effects) {
      return held_out_error(solved_on(scene, 64, effects));
    };
    const double by_itself = heldout(found(PerMeter(32.8), shape).effects);
    EXPECT_LT(by_itself, heldout(absorbing(PerMeter(32.8))));
    EXPECT_LT(by_itself, 0.8 * heldout({}));
  }
}

TEST_P(EffectsTestSlow, ConstantExtinctionIsFoundWithinAFactorOfThree) {
  for (const FlameShape shape : {FlameShape::plume, FlameShape::two_plumes}) {
    const EffectChoice& choice = found(PerMeter(32.8), shape);
    EXPECT_TRUE(choice.reports[0].on);
    EXPECT_GT(choice.reports[0].predicted_change, 2);
    // The hull is larger than the medium, so the extinction that fits best is less than the truth.
    const Extinction& extinction = choice.effects.extinction;
    EXPECT_GT((extinction.value + extinction.soot).value(), 10);
    EXPECT_LT((extinction.value + extinction.soot).value(), 45);
  }
}

/// Sums over the key points: the light, and the extinction weighted by it; `even` where the volume holds
/// none.
struct LightAndExtinction {
  double light = 0;
  double extinction = 0;  // 1/m, its mean over the light
};
LightAndExtinction sums_of(const Volume& volume, PerMeter even = PerMeter(0)) {
  LightAndExtinction sums;
  for (std::size_t p = 0; 3 * p < volume.emission.size(); ++p) {
    const auto here = static_cast<double>(volume.emission[3 * p]);
    sums.light += here;
    sums.extinction +=
        here * (volume.extinction.empty() ? even.value() : static_cast<double>(volume.extinction[p]));
  }
  sums.extinction /= sums.light;
  sums.light *= std::pow(static_cast<double>(volume.grid.edge), 3);
  return sums;
}

struct AbsorbingCase {
  FlameShape shape;
  Absorber absorber;
  double extinction;  // 1/m
  int width, cameras;
  std::array<int, 2> voxels;
};

TEST_P(EffectsTestSlow, OneExtinctionIsFoundWhateverVoxelsPicturesAndViews) {
  const EffectRequest request = value_of(parse_effects("auto:light=0"));
  for (const auto& [shape, absorber, extinction, width, cameras, voxels] :
       {AbsorbingCase{FlameShape::plume, Absorber::medium, 32.8, 160, 10, {62, 24}},
        AbsorbingCase{FlameShape::two_plumes, Absorber::soot, 20, 320, 7, {40, 128}},
        AbsorbingCase{FlameShape::plume, Absorber::medium, 32.8, 640, 5, {48, 80}},
        AbsorbingCase{FlameShape::plume, Absorber::soot, 32.8, 160, 12, {64, 32}}}) {
    PaperSceneOptions options = small_film({width, width * 3 / 4});
    options.flame.shape = shape;
    options.flame.absorber = absorber;
    options.flame.extinction = PerMeter(extinction);
    options.cameras = cameras;
    const Scene scene = paper_scene(options);
    std::array<EffectChoice, 2> choices;
    for (std::size_t n = 0; n < voxels.size(); ++n)
      choices[n] = value_of(choose_effects(scene, grid_over(scene.box, voxels[n]), request, {}));
    const Extinction& found = choices[0].effects.extinction;
    EXPECT_TRUE(choices[0].reports[0].on) << choices[0].reports[0].reason;
    EXPECT_EQ(found.value, choices[1].effects.extinction.value) << voxels[1] << " voxels";
    EXPECT_EQ(found.soot, choices[1].effects.extinction.soot) << voxels[1] << " voxels";
    const FlameTruth truth = Flame(options.flame).at(Seconds(0), grid_over(scene.box, 64));
    const auto expected = sums_of(truth.volume, truth.effects.extinction.value);
    const auto solved = sums_of(solved_on(scene, voxels[0], choices[0].effects).volume);
    EXPECT_NEAR(solved.light, expected.light, 0.25 * expected.light) << width << " pixels, " << cameras;
    // Coarse pictures hardly distinguish a thin even medium from a thick one like soot: within a factor of
    // two.
    EXPECT_GT(solved.extinction, 0.5 * expected.extinction) << width << " pixels";
    EXPECT_LT(solved.extinction, 2 * expected.extinction) << width << " pixels";
  }
}

TEST_P(EffectsTestSlow, AFieldSetByHandStartsFromTheEstimateOnEachGrid) {
  const Scene scene = small_flame_scene();
  for (const int voxels : {24, 40, 62}) {
    const auto choice = value_of(
        choose_effects(scene, grid_over(scene.box, voxels), value_of(parse_effects("extinction=field")), {}));
    EXPECT_TRUE(choice.reports[0].on);
    EXPECT_GT(sums_of(solved_on(scene, voxels, choice.effects).volume).extinction, 15) << voxels;
  }
}

TEST_P(EffectsTest, SetByHandIsTakenAndItsChangePredicted) {
  const Scene scene = small_flame_scene();
  const auto request = value_of(parse_effects("extinction=32.8"));
  const auto choice = value_of(choose_effects(scene, grid_over(scene.box, 64), request, {}));
  EXPECT_EQ(choice.effects.extinction.value, PerMeter(32.8));
  EXPECT_GT(choice.reports[0].predicted_change, 2);
  EXPECT_EQ(choice.reports[0].reason, "set by hand");
}

TEST(Effects, PicturesThatACalibrationMadeLinearAreNotBentTwice) {
  Scene scene = small_flame_scene();
  scene.linearised = true;
  for (const char* words : {"gamma=2.2", "auto:gamma=2.2"}) {
    EXPECT_THAT(choose_effects(scene, grid_over(scene.box, 64), *parse_effects(words), {}),
                FailsWith("linear already"))
        << words;
  }
}

TEST(Effects, WholeTableIsParsedByName) {
  const auto request = value_of(parse_effects(
      "extinction=32.8,scattering=single:albedo=0.25:g=-0.3,background=10/11.5/12,exposure=0.004:rise=0.8,"
      "refraction=curved:flame=1500:ambient=300,gamma=2.2,saturation=250,motion=1.2"));
  const auto& [extinction, scattering, refraction, background, exposure, sensor, motion, light] =
      *request.fixed;
  EXPECT_EQ(light.source, Light::Source::none);
  EXPECT_EQ(extinction.model, Extinction::Model::constant);
  EXPECT_EQ(extinction.value, PerMeter(32.8));
  EXPECT_EQ(scattering.order, Scattering::Order::single);
  EXPECT_EQ(scattering.albedo, 0.25);
  EXPECT_EQ(scattering.asymmetry, -0.3);
  EXPECT_EQ(background.kind, Background::Kind::constant);
  EXPECT_EQ(background.radiance, (std::array<double, 3>{10, 11.5, 12}));
  EXPECT_EQ(exposure.shutter, Exposure::Shutter::integrated);
  EXPECT_EQ(exposure.time, Seconds(0.004));
  EXPECT_EQ(exposure.rise_speed, 0.8);
  EXPECT_EQ(refraction.rays, Refraction::Rays::curved);
  EXPECT_EQ(refraction.flame, Kelvin(1500));
  EXPECT_EQ(refraction.ambient, Kelvin(300));
  EXPECT_EQ(sensor.response, Sensor::Response::gamma);
  EXPECT_EQ(sensor.gamma, 2.2);
  EXPECT_EQ(motion.carry, Motion::Carry::uniform);
  EXPECT_EQ(motion.velocity, (std::array<double, 3>{0, 0, 1.2}));
  EXPECT_EQ(sensor.clipping, Sensor::Clipping::at_white);
  EXPECT_EQ(sensor.white, 250);
}

TEST(Effects, ChoicesWithoutParametersTakeTheirDefaults) {
  const auto fixed = [](const char* text) { return *value_of(parse_effects(text)).fixed; };
  EXPECT_EQ(fixed("extinction=field").extinction.model, Extinction::Model::field);
  EXPECT_EQ(fixed("scattering=multiple,extinction=9").scattering.order, Scattering::Order::multiple);
  EXPECT_EQ(fixed("background=image").background.kind, Background::Kind::image);
  EXPECT_EQ(fixed("background=7").background.radiance, (std::array<double, 3>{7, 7, 7}));
  EXPECT_EQ(fixed("exposure=0.01").exposure.rise_speed, Exposure{}.rise_speed);
  EXPECT_EQ(fixed("refraction=curved").refraction.flame, Kelvin(1800));
  EXPECT_EQ(fixed("gamma=2.2").sensor.white, 255);
  EXPECT_EQ(fixed("gamma=2.2").sensor.clipping, Sensor::Clipping::none);
}

TEST(Effects, LeavingEveryEffectOutByNameIsNone) {
  const Effects effects = *parse_effects(
                               "extinction=none,scattering=none,refraction=straight,background=black,"
                               "exposure=instant,gamma=1,saturation=none")
                               ->fixed;
  EXPECT_FALSE(parse_effects("auto")->fixed.has_value());
  for (const Effects& e : {effects, *parse_effects("none")->fixed}) {
    EXPECT_EQ(e.extinction.model, Extinction::Model::none);
    EXPECT_EQ(e.scattering.order, Scattering::Order::none);
    EXPECT_EQ(e.refraction.rays, Refraction::Rays::straight);
    EXPECT_EQ(e.background.kind, Background::Kind::black);
    EXPECT_EQ(e.exposure.shutter, Exposure::Shutter::instant);
    EXPECT_EQ(e.sensor.response, Sensor::Response::linear);
    EXPECT_EQ(e.sensor.clipping, Sensor::Clipping::none);
  }
}

TEST(Effects, AutoTakesWhatThePicturesCannotTell) {
  const auto request = value_of(parse_effects(
      "auto:albedo=0.3:g=-0.2:flame=1500:ambient=300:exposure=0.008:rise=2:gamma=2.2:white=250:tolerance=0."
      "1"));
  EXPECT_FALSE(request.fixed.has_value());
  EXPECT_EQ(request.tolerance, 0.1);
  const Effects& assumed = request.assumed;
  EXPECT_EQ(assumed.scattering.albedo, 0.3);
  EXPECT_EQ(assumed.scattering.asymmetry, -0.2);
  EXPECT_EQ(assumed.refraction.flame, Kelvin(1500));
  EXPECT_EQ(assumed.refraction.ambient, Kelvin(300));
  EXPECT_EQ(assumed.exposure.time, Seconds(0.008));
  EXPECT_EQ(assumed.exposure.rise_speed, 2);
  EXPECT_EQ(assumed.sensor.gamma, 2.2);
  EXPECT_EQ(assumed.sensor.white, 250);
}

TEST(Effects, WithNothingToldAutoAssumesNoAlbedoAndALinearSensor) {
  const auto request = value_of(parse_effects("auto"));
  EXPECT_EQ(request.tolerance, 0.5);
  EXPECT_EQ(request.assumed.scattering.albedo, 0);
  EXPECT_EQ(request.assumed.scattering.asymmetry, 0.6);
  EXPECT_EQ(request.assumed.refraction.flame, Kelvin(1800));
  EXPECT_EQ(request.assumed.exposure.time, Seconds(0));
  EXPECT_EQ(request.assumed.sensor.gamma, 1);
  EXPECT_EQ(request.assumed.sensor.white, 255);
}

TEST(Effects, BadListsAreRefusedWithTheTablesNames) {
  const char* const kBad[] = {"",
                              "extinction",
                              "extinction=",
                              "extinction=-1",
                              "extinction=nan",
                              "extinction=1e999",
                              "extinction=3x",
                              "extinction=inf",
                              "fog=3",
                              "extinction=1,extinction=2",
                              "extinction=1,",
                              ",",
                              "extinction=1,,gamma=2",
                              "extinction=1:albedo=1",
                              "extinction=1:",
                              "none,gamma=2",
                              "auto,gamma=2",
                              "auto:",
                              "auto:fog=3",
                              "auto:albedo",
                              "auto:albedo=1.1",
                              "auto:albedo=0.1:albedo=0.2",
                              "auto:g=-2",
                              "auto:exposure=-1",
                              "auto:gamma=0",
                              "auto:tolerance=-1",
                              "auto:tolerance=nan",
                              "auto=1",
                              "automatic",
                              "scattering=single",
                              "scattering=some,extinction=1",
                              "scattering=single:albedo=1.1,extinction=1",
                              "scattering=single:g=1.1,extinction=1",
                              "scattering=single:g=,extinction=1",
                              "scattering=single:g,extinction=1",
                              "scattering=single:g=0:g=0,extinction=1",
                              "scattering=none:g=0.1",
                              "refraction=1",
                              "refraction=curved:flame=10",
                              "refraction=curved:flame=nan",
                              "refraction=straight:flame=1800",
                              "background=1/2",
                              "background=1/2/3/4",
                              "background=1//3",
                              "background=1/2/",
                              "background=-1",
                              "background=red",
                              "exposure=-1",
                              "exposure=11",
                              "exposure=",
                              "exposure=0.01:rise=101",
                              "exposure=0.01:speed=1",
                              "gamma=0",
                              "gamma=-2.2",
                              "gamma=nan",
                              "gamma=none",
                              "saturation=0",
                              "saturation=-1",
                              "saturation=nan",
                              "saturation=inf"};
  for (const char* bad : kBad) {
    const auto request = parse_effects(bad);
    ASSERT_FALSE(request.ok()) << bad;
    EXPECT_EQ(request.error().where, "effects");
    for (const char* name :
         {"extinction=", "scattering=", "refraction=", "background=", "exposure=", "gamma=", "saturation="})
      EXPECT_NE(request.error().remedy.find(name), std::string::npos) << bad;
  }
}

TEST(Effects, ThePapersOpacityAsExtinction) {
  EXPECT_NEAR(extinction_of_opacity(0.05, Meters(0.2 / 128)).value(), 32.83, 0.01);
}

}  // namespace
}  // namespace emberlock::recon
