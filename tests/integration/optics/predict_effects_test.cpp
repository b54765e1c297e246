// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/predict_effects.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "recon/adjust/picture_error.h"
#include "recon/effects/sensor.h"
#include "recon/synthetic/flame.h"
#include "tests/support/devices.h"
#include "tests/support/results.h"

namespace emberlock {
namespace {

ON_EACH_DEVICE(PredictEffects);

using Pictures = std::vector<recon::RadianceImage>;

recon::ComputeOptions on_threads(int threads) { return {device_here(), threads}; }

/// A flame filmed finely, and the same flame on a coarse grid.
struct Filmed {
  recon::PaperSceneOptions options;
  recon::Scene scene;
  std::vector<recon::FlameMask> masks;
  recon::FlameTruth fine, coarse;

  explicit Filmed(recon::Absorber absorber, PerMeter extinction = PerMeter(32.8),
                  recon::FlameShape shape = recon::FlameShape::plume) {
    options.flame.shape = shape;
    options.flame.absorber = absorber;
    options.flame.extinction = extinction;
    options.image = {160, 120};
    options.truth_voxels = 80;
    scene = recon::paper_scene(options);
    masks = recon::flame_masks(scene);
    const recon::Flame flame(options.flame);
    fine = flame.at(Seconds(0), recon::grid_over(scene.box, options.truth_voxels));
    coarse = flame.at(Seconds(0), recon::grid_over(scene.box, 64));
  }

  [[nodiscard]] recon::EffectChoice predict(const char* words, int threads = 0) const {
    return value_of(recon::predict_effects({scene, masks, coarse.volume, coarse.medium}, coarse.effects,
                                           value_of(recon::parse_effects(words)), on_threads(threads)));
  }

  /// Full pictures of the fine flame under its extinction and what `words` name, seen by cameras that have
  /// sunk by `rise`.
  [[nodiscard]] Pictures full(const char* words, double rise = 0) const {
    recon::Effects effects = *recon::parse_effects(words)->fixed;
    effects.extinction = fine.effects.extinction;
    recon::Pool pool(0, device_here());
    recon::RenderOptions render;
    render.step = 0.5;
    const recon::ScatterField scattered = recon::find_in_scatter(fine.volume, fine.medium, effects, {}, pool);
    render.scattered = &scattered;
    Pictures out;
    for (const recon::View& view : scene.views) {
      recon::CameraModel camera = view.camera;
      camera.camera_from_world.translation += camera.camera_from_world.rotation * Eigen::Vector3d(0, 0, rise);
      out.push_back(recon::render_view(fine.volume, fine.medium, effects, camera, render));
    }
    return out;
  }

  /// RMS over the input views' flame boxes after the best gain on the second: the definition, once more.
  [[nodiscard]] double change_over_boxes(const Pictures& with, const Pictures& without) const {
    const auto mean_square = [&](double gain) {
      double sum = 0;
      int views = 0;
      for (std::size_t v = 0; v < scene.views.size(); ++v) {
        if (scene.views[v].role != recon::ViewRole::input) continue;
        recon::RadianceImage scaled = without[v];
        for (float& value : scaled.rgb) value *= static_cast<float>(gain);
        sum += std::pow(recon::all_channels(recon::rmse(with[v], scaled, masks[v].box)), 2);
        ++views;
      }
      return sum / views;
    };
    // A parabola in the gain: three values have its lowest point.
    const double a = mean_square(0.5);
    const double b = mean_square(1);
    const double c = mean_square(1.5);
    const double best = 1 - 0.25 * (c - a) / (c - 2 * b + a);
    return std::sqrt(mean_square(best));
  }
};

const Filmed& sooty() {
  static const Filmed filmed(recon::Absorber::soot);
  return filmed;
}
const Filmed& two_even_plumes() {
  static const Filmed filmed(recon::Absorber::medium, PerMeter(32.8), recon::FlameShape::two_plumes);
  return filmed;
}

const recon::EffectReport& report_of(const recon::EffectChoice& choice, std::string_view name) {
  const auto at = std::find_if(choice.reports.begin(), choice.reports.end(),
                               [&](const recon::EffectReport& r) { return r.name == name; });
  EXPECT_NE(at, choice.reports.end()) << name;
  return *at;
}

std::string names_of_those_on(const recon::EffectChoice& choice) {
  std::string names;
  for (const recon::EffectReport& report : choice.reports)
    if (report.on) names += (names.empty() ? "" : ", ") + report.name;
  return names;
}

void expect_within(double factor, double predicted, double full, const char* what) {
  EXPECT_LT(predicted, factor * full) << what;
  EXPECT_GT(predicted, full / factor) << what;
}

/// The change that `asked` predicts of an effect is that of the full simulation's pictures, within a factor.
recon::EffectReport expect_predicted(double factor, const char* effect, const Filmed& filmed,
                                     const std::string& asked, const Pictures& full, const Pictures& plain) {
  recon::EffectReport report = report_of(filmed.predict(asked.c_str()), effect);
  expect_within(factor, report.predicted_change, filmed.change_over_boxes(full, plain), asked.c_str());
  return report;
}

TEST_P(PredictEffects, InScatterIsTheFullSimulationsWithinTwoFifths) {
  const auto compare = [](const Filmed& filmed, const Pictures& plain, const std::string& parameters) {
    const Pictures full = filmed.full(("extinction=1,scattering=multiple:" + parameters).c_str());
    EXPECT_TRUE(
        expect_predicted(1.4, "scattering", filmed, "auto:tolerance=0.01:" + parameters, full, plain).on);
  };
  const Pictures plain = sooty().full("none");
  for (const char* parameters : {"albedo=0.1:g=0", "albedo=0.5:g=0", "albedo=0.9:g=0", "albedo=0.5:g=0.6"})
    compare(sooty(), plain, parameters);
  compare(two_even_plumes(), two_even_plumes().full("none"), "albedo=0.5:g=0");
}

TEST_P(PredictEffects, PhaseFunctionIsTheFullSimulationsWithinAFifth) {
  const std::string isotropic = "extinction=1,scattering=multiple:albedo=0.5";
  const Pictures plain = sooty().full(isotropic.c_str());
  for (const std::string g : {":g=0.6", ":g=-0.5"})
    expect_predicted(1.2, "phase function", sooty(), "auto:albedo=0.5:tolerance=0.01" + g,
                     sooty().full((isotropic + g).c_str()), plain);
}

TEST_P(PredictEffects, RefractionIsTheFullSimulationsWithinTwoFifths) {
  for (const Filmed* filmed : {&sooty(), &two_even_plumes()}) {
    const Pictures plain = filmed->full("none");
    for (const std::string ambient : {"ambient=293", "ambient=100"})  // 100 K bends three times more
      expect_predicted(1.4, "refraction", *filmed, "auto:" + ambient,
                       filmed->full(("refraction=curved:" + ambient).c_str()), plain);
  }
}

TEST_P(PredictEffects, ExposureIsTheMeanOfInstantsWithinAFactorOfTwo) {
  const Pictures plain = sooty().full("none");
  for (const double time : {0.002, 0.004, 0.008, 0.016}) {
    constexpr int kInstants = 8;
    Pictures mean;
    for (int i = 0; i < kInstants; ++i) {
      const Pictures instant = sooty().full("none", time * ((i + 0.5) / kInstants - 0.5));
      if (mean.empty())
        for (const recon::RadianceImage& image : instant) mean.emplace_back(image.size);
      for (std::size_t v = 0; v < mean.size(); ++v)
        for (std::size_t p = 0; p < mean[v].rgb.size(); ++p) mean[v].rgb[p] += instant[v].rgb[p] / kInstants;
    }
    expect_predicted(2, "exposure", sooty(), "auto:exposure=" + std::to_string(time), mean, plain);
  }
}

TEST_P(PredictEffects, GammaIsTheFullSimulationsWithinATenth) {
  const Pictures plain = sooty().full("none");
  for (const std::string gamma : {"gamma=1.05", "gamma=2.2"})
    expect_predicted(1.1, "gamma", sooty(), "auto:" + gamma, sooty().full(gamma.c_str()), plain);
}

TEST_P(PredictEffects, AnEvenBackgroundIsFoundAtTheBordersAndItsChangePredicted) {
  Filmed filmed = sooty();
  const Pictures lit = filmed.full("background=8/5/3");
  const double full = filmed.change_over_boxes(lit, filmed.full("none"));
  for (std::size_t v = 0; v < lit.size(); ++v) filmed.scene.views[v].image = recon::share(lit[v]);
  filmed.masks = recon::flame_masks(filmed.scene);
  const recon::EffectChoice choice = filmed.predict("auto:albedo=0");
  EXPECT_EQ(names_of_those_on(choice), "background");
  EXPECT_EQ(choice.effects.background.kind, recon::Background::Kind::constant);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(choice.effects.background.radiance[c], (std::array{8.0, 5.0, 3.0})[c], 0.01);
  expect_within(1.2, report_of(choice, "background").predicted_change, full, "background");
}

TEST_P(PredictEffects, ViewsWithBackgroundPicturesUseThem) {
  Filmed filmed = sooty();
  for (recon::View& view : filmed.scene.views) {
    recon::RadianceImage background(view.image->size);
    for (std::size_t p = 0; p < background.rgb.size(); ++p)
      background.rgb[p] = p / 3 % 160 < 80 ? 20 : 0;  // the left half is lit
    view.background = recon::share(std::move(background));
  }
  const recon::EffectChoice choice = filmed.predict("auto:albedo=0");
  EXPECT_EQ(names_of_those_on(choice), "background");
  EXPECT_EQ(choice.effects.background.kind, recon::Background::Kind::image);
  EXPECT_GT(report_of(choice, "background").predicted_change, 3);
  filmed.scene.views[2].background = recon::share(recon::RadianceImage(ImageSize{10, 10}));
  EXPECT_EQ(recon::predict_effects({filmed.scene, filmed.masks, filmed.coarse.volume, filmed.coarse.medium},
                                   filmed.coarse.effects, {}, on_threads(1))
                .error()
                .where,
            "camera 2");
}

TEST_P(PredictEffects, NoisyDarkPicturesHaveNoBackground) {
  Filmed filmed = sooty();
  filmed.options.noise = 1;
  filmed.scene = recon::paper_scene(filmed.options);
  filmed.masks = recon::flame_masks(filmed.scene);
  EXPECT_EQ(names_of_those_on(filmed.predict("auto:albedo=0")), "");
}

/// The sooty flame with all light times `gain`, clipped at `white`; returns the RMS of what is cut off.
double overexpose(Filmed& filmed, float gain, float white) {
  Pictures before;
  Pictures after;
  for (recon::View& view : filmed.scene.views) {
    recon::RadianceImage image = *view.image;
    for (float& value : image.rgb) value *= gain;
    before.push_back(image);
    for (float& value : image.rgb) value = std::min(value, white);
    after.push_back(image);
    view.image = recon::share(std::move(image));
  }
  double sum = 0;
  for (std::size_t v = 0; v < before.size(); ++v)
    if (filmed.scene.views[v].role == recon::ViewRole::input)
      sum += std::pow(recon::all_channels(recon::rmse(before[v], after[v], filmed.masks[v].box)), 2) / 10;
  return std::sqrt(sum);
}

TEST_P(PredictEffects, WhatSaturatedPixelsLackIsPredictedWithinAHalf) {
  for (const float gain : {1.3F, 1.6F, 2.0F}) {
    for (const float white : {255.0F, 247.5F}) {  // the latter after a black level was taken out
      Filmed filmed = sooty();
      const double missing = overexpose(filmed, gain, white);
      const recon::EffectChoice choice = filmed.predict("auto:albedo=0");
      EXPECT_EQ(names_of_those_on(choice), "saturation");
      EXPECT_EQ(choice.effects.sensor.clipping, recon::Sensor::Clipping::at_white);
      EXPECT_EQ(choice.effects.sensor.white, static_cast<double>(white));
      expect_within(1.5, report_of(choice, "saturation").predicted_change, missing, "saturation");
    }
  }
}

TEST_P(PredictEffects, BrightPicturesThatDoNotEndAtWhiteAreNotSaturated) {
  Filmed filmed = sooty();
  overexpose(filmed, 2, 1e6F);
  EXPECT_EQ(names_of_those_on(filmed.predict("auto:albedo=0")), "");
}

TEST_P(PredictEffects, EightMillisecondsOfExposureAreCalledForAndOneIsNot) {
  const recon::EffectChoice eight = sooty().predict("auto:albedo=0:exposure=0.008:rise=-1");
  EXPECT_EQ(names_of_those_on(eight), "exposure");
  EXPECT_EQ(eight.effects.exposure.shutter, recon::Exposure::Shutter::integrated);
  EXPECT_EQ(eight.effects.exposure.time, Seconds(0.008));
  EXPECT_EQ(eight.effects.exposure.rise_speed, -1);
  const recon::EffectChoice one = sooty().predict("auto:albedo=0:exposure=0.001");
  EXPECT_EQ(names_of_those_on(one), "");
  EXPECT_EQ(one.effects.exposure.shutter, recon::Exposure::Shutter::instant);
}

TEST_P(PredictEffects, WhereNothingIsCalledForNothingIsOn) {
  const Filmed glowing(recon::Absorber::medium, PerMeter(0));
  for (const recon::EffectChoice& choice : {glowing.predict("auto"), sooty().predict("auto:albedo=0.01")}) {
    EXPECT_EQ(names_of_those_on(choice), "");
    EXPECT_EQ(choice.reports.size(), 7u);
    EXPECT_EQ(choice.effects.scattering.order, recon::Scattering::Order::none);
    EXPECT_EQ(choice.effects.refraction.rays, recon::Refraction::Rays::straight);
    EXPECT_EQ(choice.effects.background.kind, recon::Background::Kind::black);
    EXPECT_EQ(choice.effects.exposure.shutter, recon::Exposure::Shutter::instant);
    EXPECT_EQ(choice.effects.sensor.response, recon::Sensor::Response::linear);
    EXPECT_EQ(choice.effects.sensor.clipping, recon::Sensor::Clipping::none);
  }
}

TEST_P(PredictEffects, OnIsWhatChangesThePicturesByTheToleranceAtLeast) {
  const std::string words = "auto:albedo=0.2:g=0.6:exposure=0.004:gamma=1.1";
  const recon::EffectChoice all = sooty().predict((words + ":tolerance=0").c_str());
  for (const double tolerance : {0.02, 0.4, 0.9, 100.0}) {
    const recon::EffectChoice some =
        sooty().predict((words + ":tolerance=" + std::to_string(tolerance)).c_str());
    for (const char* name : {"scattering", "phase function", "refraction", "exposure", "gamma"})
      EXPECT_EQ(report_of(some, name).on, report_of(all, name).predicted_change >= tolerance)
          << name << " at " << tolerance;
  }
}

TEST_P(PredictEffects, ScatteringIsSingleWhereMoreWouldNotShow) {
  const recon::EffectChoice weak = sooty().predict("auto:albedo=0.2:g=0");
  EXPECT_EQ(weak.effects.scattering.order, recon::Scattering::Order::single);
  EXPECT_NE(report_of(weak, "scattering").reason.find("the same from all sides"), std::string::npos);
  EXPECT_EQ(sooty().predict("auto:albedo=0.8").effects.scattering.order, recon::Scattering::Order::multiple);
}

TEST_P(PredictEffects, ByHandIsTakenAsItIsAndPredicted) {
  const char* words = "extinction=1,scattering=single:albedo=0.01:g=0.5,exposure=0.001,saturation=250";
  const recon::EffectChoice choice = sooty().predict(words);
  EXPECT_EQ(names_of_those_on(choice), "scattering, phase function, exposure, saturation");
  EXPECT_EQ(choice.effects.scattering.albedo, 0.01);
  EXPECT_EQ(choice.effects.scattering.asymmetry, 0.5);
  EXPECT_EQ(choice.effects.exposure.time, Seconds(0.001));
  EXPECT_EQ(choice.effects.sensor.white, 250);
  EXPECT_GT(report_of(choice, "scattering").predicted_change, 0);
  EXPECT_EQ(report_of(choice, "refraction").predicted_change, 0);
  EXPECT_EQ(report_of(choice, "refraction").reason, "left out by hand");
}

TEST_P(PredictEffects, AnEmptyMediumCallsForNothing) {
  Filmed filmed = sooty();
  std::fill(filmed.coarse.medium.inside.begin(), filmed.coarse.medium.inside.end(), std::uint8_t{0});
  filmed.coarse.medium.count = 0;
  EXPECT_EQ(names_of_those_on(filmed.predict("auto:exposure=0.008")), "");
}

TEST_P(PredictEffects, SameChoiceForAnyNumberOfThreads) {
  const char* words = "auto:albedo=0.5:exposure=0.008:gamma=1.1";
  const recon::EffectChoice one = sooty().predict(words, 1);
  for (const int threads : {2, 16}) {
    const recon::EffectChoice other = sooty().predict(words, threads);
    ASSERT_EQ(other.reports.size(), one.reports.size());
    for (std::size_t i = 0; i < one.reports.size(); ++i) {
      EXPECT_EQ(other.reports[i].name, one.reports[i].name);
      EXPECT_EQ(other.reports[i].on, one.reports[i].on);
      EXPECT_EQ(other.reports[i].predicted_change, one.reports[i].predicted_change);
      EXPECT_EQ(other.reports[i].reason, one.reports[i].reason);
    }
  }
}

TEST_P(PredictEffects, FindingOutIsTimedAndCostsAreReported) {
  double clock = 0;
  const auto request = recon::parse_effects("auto:albedo=0.2");
  const auto choice = value_of(
      recon::predict_effects({sooty().scene, sooty().masks, sooty().coarse.volume, sooty().coarse.medium, 2},
                             sooty().coarse.effects, *request, on_threads(1), [&] {
                               clock += 0.001;  // every look at the clock takes a millisecond
                               return Seconds(clock);
                             }));
  EXPECT_GT(report_of(choice, "scattering").seconds, Seconds(0));
  EXPECT_GT(report_of(choice, "scattering").cost, Seconds(0));
}

}  // namespace
}  // namespace emberlock
