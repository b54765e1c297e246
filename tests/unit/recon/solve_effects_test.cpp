// SPDX-License-Identifier: Apache-2.0
// Pictures made with an effect, reconstructed with it and without: an effect that the solver follows must
// cost nothing in quality, and one that it ignores must.
#include <algorithm>

#include <gtest/gtest.h>

#include "recon/adjust/picture_error.h"
#include "recon/adjust/solver.h"
#include "recon/render/render.h"
#include "recon/synthetic/flame.h"
#include "tests/support/devices.h"
#include "tests/support/edit_view.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(SolveEffectsSlow);

constexpr PerMeter kExtinction{32.8};

/// The paper's set-up, small, filmed under `effects`; extinction is the flame's.
Scene filmed(Effects effects, const SharedImage& background = nullptr) {
  PaperSceneOptions options;
  options.image = {160, 120};
  options.truth_voxels = 64;
  options.flame.extinction = kExtinction;
  Scene scene = paper_scene(options);
  const FlameTruth truth = Flame(options.flame).at(Seconds(0), grid_over(scene.box, options.truth_voxels));
  effects.extinction = truth.effects.extinction;
  for (View& view : scene.views) {
    view.background = background;
    RenderOptions render;
    render.background = background.get();
    view.image = share(render_view(truth.volume, truth.medium, effects, view.camera, render));
  }
  return scene;
}

double heldout(const Scene& scene, Effects effects) {
  effects.extinction = constant_extinction(kExtinction);
  SolveOptions options;
  options.compute.device = device_here();
  const auto r = solve(scene, grid_over(scene.box, 48), effects, options);
  EXPECT_TRUE(r.ok());
  return r.ok() ? all_channels(r->trace.back().heldout_rmse) : 1e9;
}

double undisturbed() {
  static const double error = heldout(filmed({}), {});
  return error;
}

TEST_P(SolveEffectsSlow, AnEvenBackgroundIsSeenThroughTheFlame) {
  Effects effects;
  effects.background = {Background::Kind::constant, {60, 50, 40}};
  const Scene scene = filmed(effects);
  const double known = heldout(scene, effects);
  EXPECT_LT(known, 1.25 * undisturbed());
  EXPECT_GT(heldout(scene, {}), 2 * known);
}

TEST_P(SolveEffectsSlow, APictureOfTheBackgroundIsSeenThroughTheFlame) {
  RadianceImage wall({160, 120});
  for (std::size_t i = 0; i < wall.rgb.size(); ++i) wall.rgb[i] = 20 + 0.4F * static_cast<float>(i / 3 % 160);
  Effects effects;
  effects.background.kind = Background::Kind::image;
  const Scene scene = filmed(effects, share(wall));
  const double known = heldout(scene, effects);
  EXPECT_LT(known, 1.25 * undisturbed());
  EXPECT_GT(heldout(scene, {}), 2 * known);
}

TEST_P(SolveEffectsSlow, GammaCodedPicturesAreMadeLinear) {
  Effects effects;
  effects.sensor.response = Sensor::Response::gamma;
  effects.sensor.gamma = 2.2;
  const Scene scene = filmed(effects);
  const double known = heldout(scene, effects);
  EXPECT_LT(known, 1.25 * undisturbed());
  EXPECT_GT(heldout(scene, {}), 1.3 * known);
}

TEST_P(SolveEffectsSlow, SaturatedPixelsBoundTheLightFromBelow) {
  Effects effects;
  effects.sensor.clipping = Sensor::Clipping::at_white;
  effects.sensor.white = 120;
  Scene scene = filmed(effects);
  const Scene unclipped = filmed({});
  scene.views.back().image = unclipped.views.back().image;  // judged by what really was there
  const double as_bounds = heldout(scene, effects);
  EXPECT_LT(as_bounds, 0.8 * heldout(scene, {}));
}

/// After gains, each view's white lies elsewhere, and one view's white is another's unsaturated light.
TEST_P(SolveEffectsSlow, EachViewsOwnSaturatedPixelsBoundTheLight) {
  Scene scene = filmed({});
  for (std::size_t v = 0; v + 1 < scene.views.size(); ++v) {
    View& view = scene.views[v];
    const auto white = static_cast<float>(100 + 15 * v);
    std::vector<std::uint8_t> bounds(view.image->rgb.size() / 3);
    edit(view.image, [&](RadianceImage& image) {
      for (std::size_t i = 0; i < image.rgb.size(); ++i) {
        if (image.rgb[i] < white) continue;
        image.rgb[i] = white;
        bounds[i / 3] = static_cast<std::uint8_t>(bounds[i / 3] | 1U << i % 3);
      }
    });
    view.bounds = share(std::move(bounds));
  }
  const double as_bounds = heldout(scene, {});
  for (View& view : scene.views) view.bounds.reset();
  EXPECT_LT(as_bounds, 0.8 * heldout(scene, {}));
}

TEST_P(SolveEffectsSlow, ARisingFlameIsSharpenedAgain) {
  Effects effects;
  effects.exposure = {Exposure::Shutter::integrated, Seconds(0.012), 1.0};
  const Scene scene = filmed(effects);
  Scene instant = scene;
  instant.views.back().image = filmed({}).views.back().image;
  // Judged on a picture taken in an instant: the volume itself, not its blur.
  const double blurred = heldout(instant, {});
  SolveOptions options;
  options.compute.device = device_here();
  effects.extinction = constant_extinction(kExtinction);
  const auto r = solve(scene, grid_over(scene.box, 48), effects, options);
  ASSERT_TRUE(r.ok());
  Effects at_once;
  at_once.extinction = effects.extinction;
  const View& unseen = instant.views.back();
  const double sharp =
      all_channels(rmse(*unseen.image, render_view(r->volume, r->hull, at_once, unseen.camera),
                        flame_mask(*unseen.image, 1).box));
  EXPECT_LT(sharp, 0.95 * blurred);
}

TEST_P(SolveEffectsSlow, CurvedRaysOfAFlameGiveTheSameVolumeAsStraightOnes) {
  const Scene scene = filmed({});
  Effects effects;
  effects.refraction.rays = Refraction::Rays::curved;
  EXPECT_NEAR(heldout(scene, effects), undisturbed(), 0.15);  // 1800 K bend rays by a hundredth of a voxel
}

TEST_P(SolveEffectsSlow, LightThatTheMediumScattersIsTakenOutOfTheEmission) {
  Effects effects;
  effects.extinction = constant_extinction(kExtinction);
  effects.scattering = {Scattering::Order::multiple, 0.6, 0};
  const Scene scene = filmed(effects);
  effects.extinction = {Extinction::Model::field, kExtinction, PerMeter(0)};
  SolveOptions options;
  options.compute.device = device_here();
  const auto r = solve(scene, grid_over(scene.box, 48), effects, options);
  ASSERT_TRUE(r.ok());
  const double error = all_channels(r->trace.back().heldout_rmse);
  EXPECT_LT(error, 1.2 * undisturbed());
  // The volume emits, scatters, and shows what was seen; with its scattering left out it is darker.
  const View& unseen = scene.views.back();
  const PixelBox box = flame_mask(*unseen.image, 1).box;
  const double again =
      all_channels(rmse(*unseen.image, render_view(r->volume, r->hull, effects, unseen.camera), box));
  EXPECT_LT(again, 1.5 * error);  // the emission has no negative places where more is scattered than shines
  Effects dark = effects;
  dark.scattering = {};
  const double without =
      all_channels(rmse(*unseen.image, render_view(r->volume, r->hull, dark, unseen.camera), box));
  EXPECT_GT(without, 2 * again);
}

TEST_P(SolveEffectsSlow, LightScatteredForwardsIsToldFromLightThatShinesEvenly) {
  Effects effects;
  effects.scattering = {Scattering::Order::single, 0.8, 0.8};
  const Scene scene = filmed(effects);
  const auto error = [&](double asymmetry) {
    Effects assumed;
    assumed.extinction = {Extinction::Model::field, kExtinction, PerMeter(0)};
    assumed.scattering = {Scattering::Order::single, 0.8, asymmetry};
    SolveOptions options;
    options.iterations = 6;
    options.compute.device = device_here();
    const auto r = solve(scene, grid_over(scene.box, 32), assumed, options);
    EXPECT_TRUE(r.ok());
    return all_channels(r->trace.back().heldout_rmse);
  };
  EXPECT_LT(error(0.8), error(0));
}

TEST_P(SolveEffectsSlow, ThePapersSolverRefusesWhatItDoesNotKnow) {
  const Scene scene = filmed({});
  SolveOptions options;
  options.solver = Solver::paper;
  Effects effects;
  effects.extinction.model = Extinction::Model::field;
  const auto r = solve(scene, grid_over(scene.box, 16), effects, options);
  ASSERT_FALSE(r.ok());
  EXPECT_NE(r.error().what.find("paper"), std::string::npos);
}

}  // namespace
}  // namespace emberlock::recon
