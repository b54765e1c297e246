// SPDX-License-Identifier: Apache-2.0
// Light from outside that falls on a medium: what reaches a place, and the density that is solved for under
// it.
#include <cmath>
#include <limits>

#include <gmock/gmock.h>

#include "recon/adjust/choose_light.h"
#include "recon/adjust/find_light.h"
#include "recon/adjust/solver.h"
#include "recon/pipeline/reconstruct.h"
#include "tests/support/edit_view.h"
#include "tests/support/lit_scene.h"
#include "tests/support/small_flame.h"
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

using Source = Light::Source;
using testing::HasSubstr;
using testing::Not;

SolveOptions on_the_cpu(int threads = 0) {
  SolveOptions options;
  options.compute.device = Device::cpu;
  options.compute.threads = threads;
  return options;
}

std::vector<Rgba> even_medium(const Grid& g, float a_metre) {
  std::vector<Rgba> medium(g.size());
  for (Rgba& x : medium) x.c[3] = g.edge * a_metre;
  return medium;
}

Light light_at(Source source, std::array<double, 3> place) {
  Light light;
  light.source = source;
  light.place = place;
  return light;
}

TEST(LightThatReaches, FallsOffAsBeerAndLambertSayWhateverTheGrid) {
  Pool pool(2);
  for (const int voxels : {16, 60, 130}) {  // the larger ones are interpolated
    const Grid g = grid_over({Eigen::Vector3d::Constant(0.5), Eigen::Vector3d::Ones()}, voxels);
    const auto reach = light_that_reaches(even_medium(g, 2), g, light_at(Source::distant, {0, 0, 3}), pool);
    for (const int k : {0, voxels / 3, voxels / 2, voxels}) {
      const double depth = 2 * (1 - static_cast<double>(k) / voxels);
      EXPECT_NEAR(reach[g.index(5, voxels / 2, k)], std::exp(-depth), 1e-3) << voxels;
    }
  }
}

TEST(LightThatReaches, FallsWithTheSquaredDistanceToOneNearby) {
  Pool pool(1);
  const Grid g = grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}, 20);
  const auto reach = light_that_reaches(even_medium(g, 0), g, light_at(Source::nearby, {0, 2, 0}), pool);
  EXPECT_NEAR(reach[g.index(10, 20, 10)], 1 / (1.5 * 1.5), 1e-4);
  EXPECT_NEAR(reach[g.index(10, 0, 10)], 1 / (2.5 * 2.5), 1e-4);
}

TEST(LightThatReaches, EvenLightIsShadedByNothing) {
  Pool pool(1);
  const Grid g = grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()}, 8);
  for (const float r : light_that_reaches(even_medium(g, 50), g, light_at(Source::even, {}), pool))
    EXPECT_EQ(r, 1);
}

const Light kFromOneSide = test::distant_light({1, -0.5, 0.4});

Scene small_lit_scene(const Light& truth = kFromOneSide) {
  test::LitScene smoke;
  smoke.image = {24, 24};
  return film_lit(smoke, lit_truth(smoke, truth));
}

Effects under_light(const Light& light) {
  Effects effects;
  effects.light = light;
  effects.extinction = {Extinction::Model::field, PerMeter(0), PerMeter(5)};
  return effects;
}

TEST(LitSolve, EmissionIsTheDensityTimesTheLightThatReachesIt) {
  const Reconstruction done = solved_on(small_lit_scene(), 16, under_light(kFromOneSide), on_the_cpu());
  const Light& light = done.effects.light;
  const Volume& volume = done.volume;
  for (std::size_t p = 0; p < volume.extinction.size(); ++p) {
    const float sigma = volume.extinction[p];
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_GE(volume.emission[3 * p + c] * 1.001, sigma * light.ambient[c]);
      EXPECT_LE(volume.emission[3 * p + c], 1.001 * sigma * (light.ambient[c] + light.strength[c]) + 1e-3);
    }
  }
}

TEST(LitSolve, SameBitsForEveryNumberOfThreads) {
  const Scene scene = small_lit_scene();
  const Reconstruction one = solved_on(scene, 16, under_light(kFromOneSide), on_the_cpu(1));
  const Reconstruction four = solved_on(scene, 16, under_light(kFromOneSide), on_the_cpu(4));
  EXPECT_EQ(one.volume.emission, four.volume.emission);
  EXPECT_EQ(one.volume.extinction, four.volume.extinction);
}

TEST(LitSolve, ALightThatNobodyFoundIsRefused) {
  const Scene scene = small_flame_scene(PerMeter(0), FlameShape::plume);
  EXPECT_EQ(solve(scene, grid_over(scene.box, 16), *parse_effects("light=found")->fixed, {}).error().kind,
            ErrorKind::bad_input);
}

TEST(LitSolve, ALampMayStandBesideTheMediumInsideOfAGenerousBox) {
  Scene scene = small_lit_scene(test::distant_light({1, 1, 1}));
  scene.box.size.setConstant(0.25);
  SolveOptions options = on_the_cpu();
  options.iterations = 1;
  const auto with_lamp_at = [&](double x) {
    return solve(scene, grid_over(scene.box, 20), under_light(light_at(Source::nearby, {x, x, x})), options);
  };
  const auto beside = with_lamp_at(0.12);
  EXPECT_TRUE(beside.ok()) << beside.error().message();
  EXPECT_EQ(with_lamp_at(0.01).error().kind, ErrorKind::bad_input);
}

/// Taken for values they make it a sixth darker.
TEST(LitSolve, SaturatedPixelsDoNotDarkenTheLight) {
  Scene scene = small_lit_scene();
  const auto brightness = [&](const Effects& effects) {
    const Light light = solved_on(scene, 16, effects, on_the_cpu()).effects.light;
    return light.strength[0] + light.ambient[0];
  };
  Effects effects = under_light(kFromOneSide);
  const double unsaturated = brightness(effects);
  effects.sensor.clipping = Sensor::Clipping::at_white;
  const float white = 140;
  effects.sensor.white = white;
  for (View& view : scene.views)
    edit(view.image, [&](RadianceImage& image) {
      for (float& value : image.rgb) value = std::min(value, white);
    });
  EXPECT_NEAR(brightness(effects), unsaturated, 0.1 * unsaturated);
}

/// choose_light() on lit smoke, as choose_effects() calls it.
struct LightSearch {
  Scene scene = small_lit_scene();
  SolveOptions options = on_the_cpu();
  Pool pool{0};
  int looks = 0;                               ///< at the clock
  int most = std::numeric_limits<int>::max();  ///< before the budget is spent

  template <class Look>
  auto with_setup(const Look& look) {
    return recon::with_setup(scene, 12, options, pool, look);
  }
  Elapsed clock() {
    looks = 0;
    return [&] { return Seconds(++looks > most ? 1 : 0); };
  }
  LightChoice choice(const EffectRequest& request = {}) {
    return with_setup([&](const SolverSetup& setup) {
      return choose_light(setup, {Extinction::Model::field, PerMeter(0), PerMeter(5)}, true, request,
                          clock());
    });
  }
};

TEST(LightChoiceSlow, WithoutTimeToCompareNothingIsBelieved) {
  LightSearch search;
  search.options.budget = Seconds(1);
  const FoundLight found = search.with_setup([&](const SolverSetup& setup) {
    return find_light(setup, light_at(Source::found, {}), search.clock());
  });
  ASSERT_EQ(found.light.source, Source::distant);
  search.most = search.looks + 3;  // before the search, and as the first half of the comparison begins
  const EffectReport cut = search.choice().report;
  EXPECT_FALSE(cut.on);
  EXPECT_EQ(cut.predicted_change, 0);
  EXPECT_THAT(cut.reason, HasSubstr("no time to compare"));
  EXPECT_THAT(cut.reason, Not(HasSubstr("inf")));
}

TEST(LightChoice, OfALightByHandNothingIsSaidThatWasNotTried) {
  LightSearch search;
  EffectRequest request;
  request.fixed = under_light(light_at(Source::distant, {1, -0.5, 0.4}));
  EXPECT_THAT(search.choice(request).report.reason, Not(HasSubstr("even light")));
  const FoundLight found =
      search.with_setup([&](const SolverSetup& setup) { return find_light(setup, request.fixed->light); });
  EXPECT_FALSE(found.even_error);
}

ReconstructOptions under_a_light_by_hand() {
  ReconstructOptions options;
  options.voxels = 12;
  options.solve = on_the_cpu();
  options.solve.iterations = 2;
  options.effects = EffectRequest{under_light(light_at(Source::distant, {1, -0.5, 0.4}))};
  return options;
}

TEST(LitReconstruction, HasNoTemperature) {
  ReconstructOptions options = under_a_light_by_hand();
  options.temperature = TemperatureRequest{};
  options.effects->fixed->light.source = Source::found;
  EXPECT_EQ(reconstruct(small_lit_scene(), options, SteadyClock()).error().kind, ErrorKind::bad_input);
}

TEST(LitReconstruction, SaysWhyNoiseHasNoErrors) {
  ReconstructOptions options = under_a_light_by_hand();
  options.errors = true;
  const auto outcome = value_of(reconstruct(small_lit_scene(), options, SteadyClock()));
  EXPECT_FALSE(outcome.noise);
  EXPECT_FALSE(outcome.report.errors->noise);
  EXPECT_FALSE(outcome.report.errors->why_no_noise.empty());
}

TEST(ParseLight, ReadsEachOfItsWords) {
  EXPECT_EQ(parse_effects("light=none")->fixed->light.source, Source::none);
  EXPECT_EQ(parse_effects("light=none")->fixed->extinction.model, Extinction::Model::none);
  EXPECT_EQ(parse_effects("light=even")->fixed->extinction.model, Extinction::Model::field);
  EXPECT_EQ(parse_effects("light=found,extinction=field")->fixed->light.source, Source::found);
  const auto near = value_of(parse_effects("light=nearby:x=1:y=-2:z=0.5"));
  EXPECT_EQ(near.fixed->light.source, Source::nearby);
  EXPECT_EQ(near.fixed->light.place, (std::array<double, 3>{1, -2, 0.5}));
  EXPECT_EQ(parse_effects("light=distant:z=2")->fixed->light.place, (std::array<double, 3>{0, 0, 2}));
  EXPECT_EQ(parse_effects("auto:light=0")->assumed.light.source, Source::none);
  EXPECT_EQ(parse_effects("auto")->assumed.light.source, Source::found);
}

TEST(ParseLight, RefusesWhatItCannotRead) {
  for (const char* words :
       {"light", "light=", "light=sun", "light=distant", "light=distant:x=0", "light=distant:x=one",
        "light=distant:x=1:w=2", "light=even:x=1", "light=nearby:x=1e9", "light=found,light=even",
        "light=even,extinction=none", "light=even,extinction=3", "light=found,extinction=none",
        "light=found,extinction=3", "auto:light=2", "light=found,extinction=field,scattering=single"})
    EXPECT_FALSE(parse_effects(words).ok()) << words;
}

}  // namespace
}  // namespace emberlock::recon
