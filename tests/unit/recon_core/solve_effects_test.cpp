// SPDX-License-Identifier: Apache-2.0
// Pictures made with an effect, reconstructed with it and without: an effect that the solver follows must
// cost nothing in quality, and one that it ignores must.

#include <gtest/gtest.h>

#include "recon/adjust/picture_error.h"
#include "recon/adjust/solver.h"
#include "recon/render/render.h"
#include "recon/synthetic/flame.h"
#include "tests/support/devices.h"
#include "tests/support/edit_view.h"
#include "tests/support/pictures.h"
#include "tests/support/small_flame.h"
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(SolveEffects);

ON_EACH_DEVICE(SolveEffectsSlow);

constexpr PerMeter kExtinction{32.8};

/// The paper's set-up, small, filmed under `effects`; extinction is the flame's.
Scene filmed(Effects effects, const SharedImage& background = nullptr) {
  PaperSceneOptions options = small_film();
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
  return held_out_error(solved_on(scene, 48, effects));
}

double undisturbed() {
  static const double error = heldout(filmed({}), {});
  return error;
}

/// Following the effects costs little, ignoring them costs a factor.
void expect_followed(const Scene& scene, const Effects& effects, double ignored) {
  const double known = heldout(scene, effects);
  EXPECT_LT(known, 1.25 * undisturbed());
  EXPECT_GT(heldout(scene, {}), ignored * known);
}

TEST_P(SolveEffectsSlow, AnEvenBackgroundIsSeenThroughTheFlame) {
  Effects effects;
  effects.background = {Background::Kind::constant, {60, 50, 40}};
  expect_followed(filmed(effects), effects, 2);
}

TEST_P(SolveEffectsSlow, APictureOfTheBackgroundIsSeenThroughTheFlame) {
  const RadianceImage wall = radiance_of({160, 120}, [](int x, int, int) { return 20 + 0.4 * x; });
  Effects effects;
  effects.background.kind = Background::Kind::image;
  expect_followed(filmed(effects, share(wall)), effects, 2);
}

TEST_P(SolveEffectsSlow, GammaCodedPicturesAreMadeLinear) {
  Effects effects;
  effects.sensor.response = Sensor::Response::gamma;
  effects.sensor.gamma = 2.2;
  expect_followed(filmed(effects), effects, 1.3);
}

TEST_P(SolveEffectsSlow, SaturatedPixelsBoundTheLightFromBelow) {
  Effects effects;
  effects.sensor.clipping = Sensor::Clipping::at_white;
  effects.sensor.white = 120;
  Scene scene = filmed(effects);
  scene.views.back().image = filmed({}).views.back().image;  // judged by what really was there
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
  effects.extinction = constant_extinction(kExtinction);
  const Reconstruction r = solved_on(scene, 48, effects);
  Effects at_once;
  at_once.extinction = effects.extinction;
  const View& unseen = instant.views.back();
  const double sharp = all_channels(rmse(*unseen.image, render_view(r.volume, r.hull, at_once, unseen.camera),
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
  const Reconstruction r = solved_on(scene, 48, effects);
  const double error = held_out_error(r);
  EXPECT_LT(error, 1.2 * undisturbed());
  // The volume emits, scatters, and shows what was seen; with its scattering left out it is darker.
  const View& unseen = scene.views.back();
  const auto shown_under = [&](const Effects& shown) {
    return all_channels(rmse(*unseen.image, render_view(r.volume, r.hull, shown, unseen.camera),
                             flame_mask(*unseen.image, 1).box));
  };
  const double again = shown_under(effects);
  EXPECT_LT(again, 1.5 * error);  // the emission has no negative places where more is scattered than shines
  effects.scattering = {};
  EXPECT_GT(shown_under(effects), 2 * again);
}

TEST_P(SolveEffectsSlow, LightScatteredForwardsIsToldFromLightThatShinesEvenly) {
  Effects effects;
  effects.scattering = {Scattering::Order::single, 0.8, 0.8};
  const Scene scene = filmed(effects);
  const auto error = [&](double asymmetry) {
    Effects assumed;
    assumed.extinction = {Extinction::Model::field, kExtinction, PerMeter(0)};
    assumed.scattering = {Scattering::Order::single, 0.8, asymmetry};
    return held_out_error(solved_on(scene, 32, assumed, solve_options(6)));
  };
  EXPECT_LT(error(0.8), error(0));
}

TEST_P(SolveEffects, ThePapersSolverRefusesWhatItDoesNotKnow) {
  const Scene scene = filmed({});
  Effects effects;
  effects.extinction.model = Extinction::Model::field;
  EXPECT_THAT(solve(scene, grid_over(scene.box, 16), effects, solve_options(0, Solver::paper)),
              FailsWith("paper"));
}

}  // namespace
}  // namespace emberlock::recon
