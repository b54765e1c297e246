// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/noise_errors.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/random.h"
#include "recon/export/error_words.h"
#include "recon/temperature/neighbour_mean.h"
#include "recon/temperature/view_errors.h"
#include "tests/support/pictures.h"
#include "tests/support/small_flame.h"
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

using testing::HasSubstr;

RadianceImage noisy(const RadianceImage& image, double noise, std::uint64_t seed, std::uint64_t view) {
  RadianceImage out = image;
  for (std::size_t i = 0; i < out.rgb.size(); ++i)
    out.rgb[i] += static_cast<float>(noise * random_normal(seed, view, i));
  return out;
}

Scene noisy(const Scene& scene, double noise, std::uint64_t seed) {
  Scene out = scene;
  for (std::size_t v = 0; v < out.views.size(); ++v)
    out.views[v].image = share(noisy(*out.views[v].image, noise, seed, v));
  return out;
}

TEST(PixelNoise, IsToldBesideASlope) {
  const RadianceImage slope =
      radiance_of({160, 120}, [](int x, int y, int) { return 40 + 0.3 * x + 0.5 * y; });
  FlameMask lit{slope.size, 1, std::vector<std::uint8_t>(160 * 120, 1), {0, 0, 160, 120}};
  EXPECT_NEAR(pixel_noise(slope, lit), 0, 1e-4);
  for (const double noise : {0.1, 1.0, 12.0})
    EXPECT_NEAR(pixel_noise(noisy(slope, noise, 1, 0), lit) / noise, 1, 0.03) << noise;
  lit.box = {};
  EXPECT_EQ(pixel_noise(slope, lit), 0) << "nothing is lit";
}

TEST(NeighbourMean, IsThatOf27AndOf0Outside) {
  const Grid grid{{0, 0, 0}, 1, 4, 3, 5};
  std::vector<float> values(2 * grid.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(random_uniform(1, 0, i));
  std::vector<float> means = values;
  Pool pool(2);
  take_neighbour_mean(means, 2, grid, pool);
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 4; ++i)
        for (std::size_t c = 0; c < 2; ++c) {
          double sum = 0;
          for (int z = std::max(0, k - 1); z <= std::min(4, k + 1); ++z)
            for (int y = std::max(0, j - 1); y <= std::min(2, j + 1); ++y)
              for (int x = std::max(0, i - 1); x <= std::min(3, i + 1); ++x)
                sum += static_cast<double>(values[2 * grid.index(x, y, z) + c]);
          ASSERT_NEAR(static_cast<double>(means[2 * grid.index(i, j, k) + c]), sum / 27, 1e-5);
        }
}

struct Noisy {
  Scene scene;
  Reconstruction done;
  NoiseErrors errors;
};

/// Pictures whose size makes two of their pixels a voxel; `noise` in grey levels.
Noisy solved(double noise, Extinction::Model model, int threads = 0) {
  const PerMeter extinction(model == Extinction::Model::none ? 0 : 32.8);
  Noisy out;
  out.scene = noisy(small_flame_scene(extinction), noise, 1);
  Effects effects;
  effects.extinction = {model, PerMeter(0), extinction};
  SolveOptions options;
  options.compute.threads = threads;
  auto done = value_of(solve(out.scene, grid_over(out.scene.box, 32), effects, options));
  out.done = std::move(done);
  auto errors = value_of(errors_by_noise(out.scene, out.done, options));
  out.errors = std::move(errors);
  return out;
}

struct Ratios {
  double by_noise = 0, by_views = 0;
};

/// Over what repeated noise does, RMS over the points with light.
Ratios over_repeated(const Noisy& s, double noise) {
  SolveOptions again;
  again.smoothness = s.done.smoothness;
  again.iterations = s.done.kept.iteration;
  constexpr int kRepeats = 10;
  const std::vector<float>& own = s.done.volume.emission;
  std::vector<double> sums(own.size());
  std::vector<double> squares(own.size());
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    const Scene other = noisy(s.scene, noise, 100 + static_cast<std::uint64_t>(repeat));
    const auto solved = solve(other, s.done.volume.grid, s.done.effects, again);
    EXPECT_TRUE(solved.ok()) << solved.error().message();
    if (!solved.ok()) return {};
    for (std::size_t i = 0; i < own.size(); ++i) {
      const double d = static_cast<double>(solved->volume.emission[i] - own[i]);
      sums[i] += d;
      squares[i] += d * d;
    }
  }
  const auto views = errors_by_views(s.scene, s.done, {});
  EXPECT_TRUE(views.ok()) << views.error().message();
  if (!views.ok()) return {};
  const float brightest = *std::max_element(own.begin(), own.end());
  double repeated = 0;
  Ratios told;
  for (std::size_t i = 0; i < own.size(); ++i) {
    if (!(own[i] > 0.05F * brightest)) continue;
    repeated += (squares[i] - sums[i] * sums[i] / kRepeats) / (kRepeats - 1);
    told.by_noise += static_cast<double>(s.errors.emission[i]) * static_cast<double>(s.errors.emission[i]);
    const auto c = static_cast<Eigen::Index>(i % 3);
    told.by_views += views->covariance(i / 3)(c, c);
  }
  return {std::sqrt(told.by_noise / repeated), std::sqrt(told.by_views / repeated)};
}

/// A found extinction isn't settled when the solve ends, so that repeated noise moves it, and the emission
/// with it, more than the parabola's lowest point.
TEST(NoiseErrorsTestSlow, AreAboutWhatRepeatedNoiseDoes) {
  for (const Extinction::Model model : {Extinction::Model::none, Extinction::Model::field})
    for (const double noise : {0.25, 1.0, 4.0}) {
      const bool found = model == Extinction::Model::field;
      const Ratios ratios = over_repeated(solved(noise, model), noise);
      EXPECT_GT(ratios.by_noise, found ? 0.3 : 0.9) << noise;
      EXPECT_LT(ratios.by_noise, 3) << noise;
      std::printf("noise %g, extinction %s: errors over repeated noise's: by noise %.1f, by views %.1f\n",
                  noise, found ? "found" : "none", ratios.by_noise, ratios.by_views);
    }
}

TEST(NoiseErrorsTest, RiseWithTheNoiseAndDontDependOnThreads) {
  const Noisy one = solved(1, Extinction::Model::field, 1);
  const Noisy two = solved(1, Extinction::Model::field, 2);
  EXPECT_EQ(one.errors.emission, two.errors.emission);
  EXPECT_EQ(one.errors.extinction, two.errors.extinction);
  EXPECT_EQ(one.errors.steps, two.errors.steps);
  EXPECT_NEAR(one.errors.noise, 1, 0.3);
  const Noisy more = solved(4, Extinction::Model::field);
  const auto sum = [](const NoiseErrors& errors) {
    double all = 0;
    for (const float e : errors.emission) all += static_cast<double>(e);
    return all;
  };
  EXPECT_GT(sum(more.errors), 2 * sum(one.errors));
}

TEST(NoiseErrorsTest, EndWhereTheyAreToldTo) {
  Noisy s = solved(1, Extinction::Model::none);
  SolveOptions stopped;
  stopped.stop = [] { return true; };
  EXPECT_EQ(errors_by_noise(s.scene, s.done, stopped).error().kind, ErrorKind::refused);
}

TEST(ErrorWords, SayWhatWouldLowerThem) {
  ErrorSummary e;
  e.light = 100;
  e.emission = 10;
  e.solves = 9;
  e.noise = {0.5, 1, 0, 4, Seconds(2)};
  const auto said = [&] { return testing::PrintToString(error_words(e)); };
  EXPECT_THAT(said(), HasSubstr("10 %"));
  EXPECT_THAT(said(), HasSubstr("more views or a better calibration"));
  e.noise->emission = 5;
  EXPECT_THAT(said(), HasSubstr("and so would more views"));
  e.noise->emission = 9;
  EXPECT_THAT(said(), HasSubstr("longer exposure"));
  e.noise.reset();
  EXPECT_EQ(error_words(e).size(), 1U);
  e.extinction = 3;
  EXPECT_THAT(said(), HasSubstr("the extinction to +-3 1/m"));
}

}  // namespace
}  // namespace emberlock::recon
