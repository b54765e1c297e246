// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/temperature.h"

#include <cmath>
#include <memory>

#include <gmock/gmock.h>

#include "recon/temperature/self_absorption.h"
#include "tests/support/glowing_flame.h"
#include "tests/support/key_points.h"
#include "tests/support/small_flame.h"
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

test::GlowingFlameOptions small_flame(Emitter emitter) {
  test::GlowingFlameOptions options;
  options.film = small_film({320, 240}, 96);
  options.film.flame.seed = 11;
  options.emitter = emitter;
  return options;
}

/// A flame's pictures, solved; and its temperatures as they are read from them.
struct Solved {
  explicit Solved(const test::GlowingFlameOptions& options, int voxels = 64)
      : flame(std::make_shared<const test::GlowingFlame>(options)),
        response(flame->response()),
        scene(flame->film()) {
    Effects effects;
    effects.extinction = {Extinction::Model::field, PerMeter(0), options.film.flame.extinction};
    done = solved_on(scene, voxels, effects);
    errors = value_of(errors_by_views(scene, done, {}));
  }
  [[nodiscard]] TemperatureField read(std::optional<Emitter> emitter,
                                      const SolveOptions& options = {}) const {
    return temperature_of(scene, done, errors, response, emitter, options);
  }
  [[nodiscard]] TemperatureField read_by_voxel(Emitter emitter) const {
    return temperature_of(scene, test::voxel_by_voxel(done), errors, response, emitter);
  }
  [[nodiscard]] test::TemperatureScore score(const TemperatureField& field) const {
    return test::score_of(*flame, done, field);
  }

  std::shared_ptr<const test::GlowingFlame> flame;
  CameraResponse response;
  Scene scene;
  Reconstruction done;
  VolumeErrors errors;
};

/// Solved once for all tests.
const Solved& solved_of(Emitter emitter) {
  static const Solved grey(small_flame(Emitter::grey));
  static const Solved soot(small_flame(Emitter::soot));
  return emitter == Emitter::grey ? grey : soot;
}

TEST(TemperatureSlow, IsReadToATwentiethOfItsRangeAndItsErrorsHold) {
  for (const Emitter emitter : {Emitter::grey, Emitter::soot}) {
    const Solved& s = solved_of(emitter);
    const TemperatureField field = s.read(emitter);
    const test::TemperatureScore score = s.score(field);
    SCOPED_TRACE(test::words(score, field));
    EXPECT_LT(score.median, 40) << "of 1450 to 2030 K, half the resolution of the bench";
    EXPECT_LT(score.most, 90);
    EXPECT_GT(score.told, 0.95);
    EXPECT_GT(score.within, 0.85);
    EXPECT_TRUE(field.summary.by_absorption);
    for (const float v : field.kelvin) ASSERT_TRUE(std::isfinite(v));
    for (const float v : field.sigma) ASSERT_TRUE(std::isfinite(v));
  }
}

/// RMS between pictures of one flame by both renderers, grey levels.
double between_renderers(Emitter emitter, int truth_voxels) {
  test::GlowingFlameOptions options = small_flame(emitter);
  options.film.cameras = 1;
  options.film.image = {64, 48};
  options.film.truth_voxels = truth_voxels;
  options.noise = options.levels = 0;
  const Scene by_channels = test::GlowingFlame(options).film();
  options.spectral = true;
  const Scene by_wavelengths = test::GlowingFlame(options).film();
  double squares = 0;
  std::size_t values = 0;
  for (std::size_t v = 0; v < by_channels.views.size(); ++v) {
    const std::vector<float>& one = by_channels.views[v].image->rgb;
    const std::vector<float>& other = by_wavelengths.views[v].image->rgb;
    for (std::size_t i = 0; i < one.size(); ++i, ++values)
      squares += std::pow(static_cast<double>(one[i] - other[i]), 2);
  }
  return std::sqrt(squares / static_cast<double>(values));
}

TEST(TemperatureSlow, ItsPicturesAreThoseOfAnotherRenderer) {
  const double coarse = between_renderers(Emitter::grey, 64);
  const double fine = between_renderers(Emitter::grey, 128);
  EXPECT_LT(fine, 0.6) << "of 230 levels";
  EXPECT_GT(coarse / fine, 2.5) << "they differ by what lies between key points: glow, or temperature";
  EXPECT_LT(between_renderers(Emitter::soot, 128), 0.7) << "a channel's absorption is one, or many";
}

TEST(TemperatureSlow, OfNoisyPicturesIsBetterSolvedTogetherThanReadVoxelByVoxel) {
  test::GlowingFlameOptions noisy = small_flame(Emitter::grey);
  noisy.noise = 1;
  noisy.levels = 255;
  const Solved s(noisy);
  const TemperatureField alone = s.read_by_voxel(Emitter::grey);
  const TemperatureField field = s.read(Emitter::grey);
  EXPECT_EQ(alone.summary.joint.iterations, 0);
  const JointSolve& joint = field.summary.joint;
  EXPECT_LT(joint.left_out.value_or(2), kMostLeftOutMisfit);
  EXPECT_GT(joint.iterations, 0);
  EXPECT_LT(joint.after, 0.9 * joint.before);
  const test::TemperatureScore score = s.score(field);
  const test::TemperatureScore before = s.score(alone);
  SCOPED_TRACE(test::words(score, field) + "; alone " + test::words(before, alone));
  EXPECT_LT(score.median, before.median);
  EXPECT_LT(score.most, before.most);
  for (std::size_t p = 0; p < field.kelvin.size(); ++p) {
    if (!(field.kelvin[p] > 0)) continue;
    ASSERT_NEAR(field.sigma[p], std::hypot(alone.sigma[p], field.kelvin[p] - alone.kelvin[p]), 1e-2) << p;
  }
}

TEST(TemperatureSlow, OfGoodPicturesIsLeftAsItWasReadWhereLeftOutViewsSpeakAgainstTheRest) {
  const Solved& s = solved_of(Emitter::grey);
  const TemperatureField field = s.read(Emitter::grey);
  const TemperatureField alone = s.read_by_voxel(Emitter::grey);
  ASSERT_TRUE(field.summary.joint.left_out.has_value());
  EXPECT_GT(*field.summary.joint.left_out, kMostLeftOutMisfit);
  EXPECT_EQ(field.summary.joint.iterations, 0);
  EXPECT_EQ(field.kelvin, alone.kelvin);
  GlowField<float> together{std::vector<float>(alone.kelvin.size()), alone.kelvin};
  solve_together(s.scene, s.done, EmitterTable(s.response, Emitter::grey), {}, {}, together);
  TemperatureField solved_together = alone;
  solved_together.kelvin = together.kelvin;
  EXPECT_GT(s.score(solved_together).median, s.score(alone).median) << "they were right";
}

TEST(TemperatureSlow, NotKnowingWhatGlowsIsPartOfEachError) {
  const Solved& s = solved_of(Emitter::soot);
  const TemperatureField told = s.read(Emitter::grey);
  const TemperatureField untold = s.read(std::nullopt);
  EXPECT_TRUE(told.summary.emitter_told);
  EXPECT_FALSE(untold.summary.emitter_told);
  const test::TemperatureScore mistaken = s.score(told);
  const test::TemperatureScore honest = s.score(untold);
  SCOPED_TRACE(test::words(mistaken, told) + "; untold " + test::words(honest, untold));
  EXPECT_LT(mistaken.within, 0.8) << "soot read as grey, and sure of it";
  EXPECT_GT(honest.within, 0.88);
  EXPECT_GT(untold.summary.sigma, 0.8 * std::abs(untold.summary.mean - untold.summary.if_other));
}

TEST(TemperatureSlow, AJointSolveThatIsStoppedKeepsWhatItHas) {
  const Solved& s = solved_of(Emitter::grey);
  SolveOptions options;
  options.stop = [] { return true; };
  const TemperatureField field = s.read(Emitter::grey, options);
  const TemperatureField alone = s.read_by_voxel(Emitter::grey);
  EXPECT_EQ(field.summary.joint.iterations, 0);
  EXPECT_FALSE(field.summary.joint_failed);
  EXPECT_EQ(field.kelvin, alone.kelvin);
}

TEST(TemperatureSlow, SaysWhatAnotherEmitterWouldMakeOfIt) {
  const Solved& s = solved_of(Emitter::soot);
  const TemperatureSummary told = s.read(Emitter::soot).summary;
  const TemperatureSummary mistaken = s.read(Emitter::grey).summary;
  EXPECT_GT(mistaken.mean, told.mean + 60) << "soot taken for grey looks hotter";
  constexpr double kMoved = 5;  // K, what a joint solve may change of a mean: `if_other` is read without one
  EXPECT_NEAR(mistaken.if_other, told.mean, kMoved) << "and that is said";
  EXPECT_NEAR(told.if_other, mistaken.mean, kMoved);
}

TEST(TemperatureSlow, ThePapersConventionReadsGreenAlone) {
  Solved s = solved_of(Emitter::grey);
  const TemperatureField field = s.read(Emitter::paper);
  EXPECT_GT(field.summary.counts.told, 0.9 * static_cast<double>(field.summary.counts.emitting));
  EXPECT_FALSE(field.summary.by_absorption);
  s.response.absolute = false;
  const TemperatureField scaled = s.read(Emitter::paper);
  EXPECT_NEAR(*std::max_element(scaled.kelvin.begin(), scaled.kelvin.end()), 2300, 30);
  EXPECT_EQ(scaled.summary.chi_square, 0) << "nothing is left to contradict it";
}

TEST(TemperatureSlow, SaturatedCoresAreBoundsAndBlackPicturesTellNothing) {
  Solved s = solved_of(Emitter::grey);
  const TemperatureCounts before = s.read(Emitter::grey).summary.counts;
  EXPECT_EQ(before.saturated, 0U);
  for (View& view : s.scene.views) {
    std::vector<std::uint8_t> bounds(view.image->rgb.size() / 3);
    for (std::size_t p = 0; p < bounds.size(); ++p) bounds[p] = view.image->rgb[3 * p] > 120 ? 1 : 0;
    view.bounds = share(std::move(bounds));
  }
  const TemperatureField bounded = s.read(Emitter::grey);
  EXPECT_GT(bounded.summary.counts.saturated, 100U);
  EXPECT_LT(bounded.summary.counts.told, before.told);
  std::fill(s.done.volume.emission.begin(), s.done.volume.emission.end(), 0.0F);
  const TemperatureField dark = s.read(Emitter::grey);
  EXPECT_EQ(dark.summary.counts.told, 0U);
  EXPECT_EQ(*std::max_element(dark.kelvin.begin(), dark.kelvin.end()), 0);
}

/// A ball of even extinction: what leaves its middle goes through one radius, whichever the camera.
TEST(SelfAbsorption, OfABallsMiddleIsTheClosedForm) {
  Reconstruction done;
  Volume& volume = done.volume;
  volume.grid = cube_grid(0.2, 64);
  constexpr double kRadius = 0.08;
  constexpr double kAbsorption = 10;
  each_point(volume.grid, [&](int i, int j, int k) {
    const bool inside = place_of(volume.grid, i, j, k).norm() <= kRadius;
    volume.extinction.push_back(inside ? static_cast<float>(kAbsorption) : 0);
    volume.emission.insert(volume.emission.end(), 3, inside ? 100.F : 0.F);
  });
  const Scene scene = paper_scene(small_film({16, 12}, 2));
  const SelfAbsorption own = self_absorption(scene, done, test::lobes(), Emitter::soot);
  ASSERT_EQ(own.factor.size(), volume.emission.size());
  EXPECT_GT(own.channel[2], own.channel[0]) << "blue is absorbed more";
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(own.factor[3 * volume.grid.index(32, 32, 32) + c],
                std::exp((own.channel[c] - 1) * kAbsorption * kRadius), 0.02)
        << c;
  EXPECT_TRUE(self_absorption(scene, done, test::lobes(), Emitter::grey).factor.empty())
      << "grey costs nothing";
}

/// The spread of repeated noise alone, at one key point in the flame's body.
TEST(ViewErrors, CoverWhatRepeatedNoiseDoes) {
  test::GlowingFlameOptions options = small_flame(Emitter::grey);
  options.noise = 25;  // so that it outweighs the rest
  options.film.image = {120, 90};
  options.levels = 0;
  const Solved s(options, 32);
  constexpr int kRepeats = 12;
  const std::size_t points = s.done.volume.grid.size();
  std::vector<double> sum(points);
  std::vector<double> squares(points);
  SolveOptions again;
  again.smoothness = s.done.smoothness;
  again.iterations = s.done.kept.iteration;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    Scene noisy = s.scene;
    for (std::size_t v = 0; v < noisy.views.size(); ++v) {
      RadianceImage image = *noisy.views[v].image;
      for (std::size_t i = 0; i < image.rgb.size(); ++i)
        image.rgb[i] +=
            static_cast<float>(25 * random_normal(static_cast<std::uint64_t>(repeat) + 100, v, i));
      noisy.views[v].image = share(std::move(image));
    }
    const auto other = value_of(solve(noisy, s.done.volume.grid, s.done.effects, again));
    for (std::size_t p = 0; p < points; ++p) {
      const double d = static_cast<double>(other.volume.emission[3 * p] - s.done.volume.emission[3 * p]);
      sum[p] += d / kRepeats;
      squares[p] += d * d / kRepeats;
    }
  }
  double repeated = 0;
  double told = 0;
  for (std::size_t p = 0; p < points; ++p) {
    repeated += squares[p] - sum[p] * sum[p];
    told += s.errors.covariance(p)(0, 0);
  }
  EXPECT_GT(std::sqrt(told), 0.8 * std::sqrt(repeated)) << "what noise does is in it";
  EXPECT_LT(std::sqrt(told), 1.6 * std::sqrt(repeated)) << "and not much besides, where noise outweighs it";
}

TEST(ViewErrors, NeedThreeViews) {
  Scene scene = small_flame_scene();
  scene.views.resize(2);
  EXPECT_THAT(errors_by_views(scene, {}, {}), FailsWith("three views"));
}

}  // namespace
}  // namespace emberlock::recon
