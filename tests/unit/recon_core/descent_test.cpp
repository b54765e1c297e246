// SPDX-License-Identifier: Apache-2.0
// The default solver's iteration by itself: what its weights promise, and what its guard does where they
// don't hold.
#include "recon/adjust/descent.h"

#include <cmath>

#include <gtest/gtest.h>

#include "recon/adjust/cold_solve.h"
#include "recon/adjust/find_motion.h"
#include "recon/adjust/find_pointing.h"
#include "recon/adjust/left_out_views.h"
#include "recon/adjust/picture_error.h"
#include "recon/render/render.h"
#include "tests/support/devices.h"
#include "tests/support/edit_view.h"
#include "tests/support/key_points.h"
#include "tests/support/posed_scene.h"
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE_SANITIZED_TOO(DescentOn);
ON_EACH_DEVICE(PointingSearch);

double after_passes(Descent& descent, int passes) {
  for (int p = 0; p < passes; ++p) descent.pass();
  return descent.fit_error();
}

/// Its first step alone goes so far that no later one makes up for it.
Descent wild_one(const Posed& posed, float times) {
  Descent wild(posed.level, posed.setup.optics(posed.hull.grid), posed.setup);
  std::vector<float> weights = wild.engine().weights();
  for (float& w : weights) w /= times;
  wild.engine().set_weights(weights);
  return wild;
}

TEST_P(DescentOn, StepsThatAreTooLongAreTakenBackUntilTheyAreShortEnough) {
  for (const int subsets : {1, 4}) {
    SCOPED_TRACE(subsets);
    const Posed posed(device_here(), ball_of(64), 12, subsets);
    ASSERT_EQ(posed.level.subsets, subsets);
    Descent sound(posed.level, posed.setup.optics(posed.hull.grid), posed.setup);
    sound.pass();
    const double black = sound.fit_error();
    after_passes(sound, 40);
    EXPECT_EQ(sound.halvings(), 0);

    Descent wild = wild_one(posed, 64);
    double least = black;
    for (int p = 0; p < 40 + Guard::kMostHalvings; ++p) {
      wild.pass();
      least = std::min(least, wild.fit_error());
    }
    EXPECT_GT(wild.halvings(), 1);
    wild.settle();
    EXPECT_LT(wild.fit_error(), 0.2 * black);
    EXPECT_LT(wild.fit_error(), 2 * least + 0.1) << "what is left is about the best that was seen";
  }
}

TEST_P(DescentOn, WhatTheLastPassDidIsJudgedBeforeAnybodyTakesIt) {
  const Posed posed(device_here(), ball_of(64), 12, 1);
  Descent wild = wild_one(posed, 64);
  EXPECT_EQ(wild.pass(), Guard::Finding::best) << "it judges the darkness that it starts from";
  const double black = wild.fit_error();
  const std::vector<Rgba> overshot = wild.engine().get();
  wild.settle();
  EXPECT_EQ(wild.fit_error(), black);
  float brightest = 0;
  for (const Rgba& v : overshot) brightest = std::max(brightest, v.c[0]);
  EXPECT_GT(brightest, 0);
  for (const Rgba& v : wild.engine().get()) ASSERT_EQ(v.c[0], 0);

  Descent sound(posed.level, posed.setup.optics(posed.hull.grid), posed.setup);
  const double judged = after_passes(sound, 5);
  const std::vector<Rgba> x = sound.engine().get();
  sound.settle();
  EXPECT_LT(sound.fit_error(), judged) << "what is judged is what the last pass made";
  const std::vector<Rgba> settled = sound.engine().get();
  for (std::size_t p = 0; p < x.size(); ++p)
    for (int c = 0; c < 4; ++c) ASSERT_EQ(x[p].c[c], settled[p].c[c]);
}

TEST_P(DescentOn, WhatWasKeptIsTakenWhereItShowsNoMoreError) {
  const Posed posed(device_here(), ball_of(64), 12, 1);
  Descent wild = wild_one(posed, 64);
  wild.pass();
  const double dark = wild.kept_error();
  const double overshot = wild.judge();
  ASSERT_GT(overshot, dark);
  EXPECT_TRUE(wild.take_kept(overshot));
  EXPECT_EQ(wild.fit_error(), dark);

  Descent sound(posed.level, posed.setup.optics(posed.hull.grid), posed.setup);
  after_passes(sound, 5);
  const double last = sound.judge();
  EXPECT_LT(last, sound.kept_error());
  EXPECT_FALSE(sound.take_kept(last));
  EXPECT_EQ(sound.fit_error(), last);
}

TEST_P(DescentOn, StepsStayHalvedAndCountedThoughTheLightIsScatteredAnew) {
  const Posed posed(device_here(), ball_of(64), 12, 1);
  Descent wild = wild_one(posed, 64);
  int before = 0;
  for (int p = 0; p < 40; ++p) {
    wild.begin_anew();
    wild.pass();
    EXPECT_GE(wild.halvings(), before);
    before = wild.halvings();
  }
  EXPECT_GT(before, 0);
  wild.settle();
  EXPECT_LT(wild.fit_error(), 20);
}

TEST_P(DescentOn, ColdSolvesTakeAConstantExtinctionForWhatItIs) {
  Effects effects;
  effects.extinction = constant_extinction(PerMeter(20));
  const Posed posed(device_here(), ball_of(64), 12, 4, effects);
  Descent descent(posed.level, posed.setup.optics(posed.hull.grid), posed.setup);
  after_passes(descent, 24 / posed.level.subsets);
  const ColdSolve cold = cold_solve(posed.setup, posed.level, effects.extinction);
  descent.show_validation();
  EXPECT_EQ(cold.error, descent.validation_error());
  for (const Rgba& v : cold.engine->get()) ASSERT_EQ(v.c[3], 0) << "no field is found";
}

TEST_P(DescentOn, OneIterationsErrorIsThatOfWhatItMade) {
  const Scene scene = ball_of(64);
  SolveOptions options = solve_options(1);
  options.smoothness = 0.04;
  const Reconstruction r = solved_on(scene, 12, {}, options);
  ASSERT_EQ(r.trace.size(), 1U);
  double black = 0;
  double shown = 0;
  int views = 0;
  for (const View& view : scene.views) {
    if (view.role != ViewRole::input) continue;
    const PixelBox box = flame_mask(*view.image, noise_threshold(*view.image)).box;
    const auto squared = [&](const RadianceImage& image) {
      return std::pow(all_channels(rmse(image, *view.image, box)), 2);
    };
    black += squared(RadianceImage(view.image->size));
    shown += squared(render_view(r.volume, r.hull, {}, view.camera));
    ++views;
  }
  EXPECT_NEAR(input_error(r), std::sqrt(shown / views), 0.05 * std::sqrt(shown / views));
  EXPECT_LT(shown, 0.8 * black);
}

/// A picture that no steps can fit.
Scene with_an_infinite_pixel() {
  Scene scene = ball_of(64);
  edit(scene.views[1].image,
       [](RadianceImage& image) { image.rgb[3 * static_cast<std::size_t>(24 * 64 + 32)] = INFINITY; });
  return scene;
}

TEST_P(DescentOn, SearchesThatDivergeFindNothingAndEndNoReconstruction) {
  Pool pool(2, device_here());
  SolveOptions options;
  Scene scene = with_an_infinite_pixel();
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    scene.views[v].lateness = Seconds(v % 2 == 0 ? 0.004 : -0.004);
  FoundMotion motion;
  EXPECT_NO_THROW(motion = find_rise({scene, grid_over(scene.box, 24), {}, options, pool}, 0.1));
  EXPECT_EQ(motion.gain, 0);

  scene = with_an_infinite_pixel();
  scene.views[0].camera.intrinsics.cx += 12;  // so that the outlines don't meet
  FoundPointing pointing;
  EXPECT_NO_THROW(pointing = find_pointing(scene, {}, options, pool));
  EXPECT_FALSE(pointing.any());
}

TEST_P(PointingSearch, TheSearchForPointingEndsWithItsShareOfTheBudget) {
  Pool pool(2, device_here());
  SolveOptions options;
  Scene scene = ball_of(64);
  scene.views[0].camera.intrinsics.cx += 12;
  int said = 0;
  const Progress count = [&](double, std::string_view) { ++said; };
  EXPECT_TRUE(find_pointing(
                  scene, {}, options, pool, [] { return Seconds(100); }, count)
                  .any());
  EXPECT_GT(said, 16) << "a round of eight views before the move and one after it";
  options.budget = Seconds(1);
  said = 0;
  EXPECT_FALSE(find_pointing(
                   scene, {}, options, pool, [] { return Seconds(100); }, count)
                   .any());
  EXPECT_LE(said, 1);
}

TEST_P(DescentOn, TheSearchForSmoothnessEndsWithItsShareOfTheBudget) {
  const Posed posed(device_here(), ball_of(64), 12, 1);
  const LeftOutViews views(posed.setup, posed.hull);
  int looks = 0;
  const FoundSmoothness first = find_smoothness(views, {}, [&] { return ++looks > 1; });
  EXPECT_EQ(looks, 2);
  EXPECT_EQ(first.value, kLeastSmoothness);
  EXPECT_EQ(first.error, views.error({}, kLeastSmoothness));
  EXPECT_TRUE(std::isinf(find_smoothness(views, {}, [] { return true; }).error)) << "nothing is tried";
}

/// The ball as a medium that takes light, before a wall that is brighter than itself.
Scene ball_before_a_wall(const Effects& effects, double light, double extinction) {
  Scene scene = ball_of(64);
  const Hull medium = whole_grid(grid_over(scene.box, 16));
  const Grid& g = medium.grid;
  Volume truth{g, std::vector<float>(3 * g.size()), std::vector<float>(g.size())};
  each_point(g, [&](int i, int j, int k, std::size_t p) {
    const double sigma = g.nx / 8.0;
    const double squares =
        std::pow(i - g.nx / 2.0, 2) + std::pow(j - g.ny / 2.0, 2) + std::pow(k - g.nz / 2.0, 2);
    const double share = std::exp(-squares / (2 * sigma * sigma));
    for (std::size_t c = 0; c < 3; ++c) truth.emission[3 * p + c] = static_cast<float>(light * share);
    truth.extinction[p] = static_cast<float>(extinction * share);
  });
  for (View& view : scene.views) view.image = share(render_view(truth, medium, effects, view.camera));
  return scene;
}

TEST_P(DescentOn, ExtinctionBeforeABrightWallNeedsNoShorterSteps) {
  Effects effects;
  effects.background = {Background::Kind::constant, {200, 200, 200}};
  effects.extinction = {Extinction::Model::field, PerMeter(10), PerMeter(0)};
  const Posed posed(device_here(), ball_before_a_wall(effects, 600, 10), 16, 16, effects);
  const Extinction thin{Extinction::Model::field, PerMeter(1)};
  Descent descent(posed.level, posed.setup.optics(posed.hull.grid), posed.setup, {nullptr, &thin});
  for (int p = 0; p < 4; ++p) descent.pass();
  descent.release_extinction();
  const double before = descent.fit_error();
  double last = before;
  for (int p = 0; p < 40; ++p) {
    descent.pass();
    const double now = descent.fit_error();
    EXPECT_LT(now, 1.3 * last) << "pass " << p;
    last = now;
  }
  EXPECT_EQ(descent.halvings(), 0);
  EXPECT_LT(last, 0.2 * before);
}

}  // namespace
}  // namespace emberlock::recon
