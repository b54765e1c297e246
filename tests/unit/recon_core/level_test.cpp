// SPDX-License-Identifier: Apache-2.0
// How a level of resolution begins, and a pass over it, on every device: against what a loop in double
// precision makes of the same volumes.
#include "recon/kernels/level.h"

#include <array>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "recon/adjust/engine.h"
#include "recon/views/view.h"
#include "tests/support/devices.h"
#include "tests/support/key_points.h"
#include "tests/support/march_case.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE_SANITIZED_TOO(LevelOn);

constexpr int kRays[2] = {40, 30};

/// Two views of noise, before a grey wall, through a medium with holes.
struct Posed {
  explicit Posed(const Hull& medium, int subsets = 2) : pool(2, device_here()) {
    const MarchCase c = march_case();
    for (std::size_t v = 0; v < 2; ++v) {
      View view{"view", c.cameras[v], {}};
      RadianceImage image(ImageSize{kRays[0], kRays[1]});
      for (std::size_t i = 0; i < image.rgb.size(); ++i)
        image.rgb[i] = static_cast<float>(200 * random_uniform(v, 4, i));
      view.image = share(std::move(image));
      views.push_back(std::move(view));
    }
    ProblemOptions options;
    options.background = {Background::Kind::constant, {20, 10, 5}};
    options.subsets = subsets;
    options.subset_of = [subsets](std::size_t, int x, int y) { return (x + y) % subsets; };
    problem = make_problem({&views[0], &views[1]}, medium, options, pool);
  }
  [[nodiscard]] std::unique_ptr<Engine> engine(Absorb absorb = Absorb::field) {
    return make_engine(problem, {absorb, 0, 0, {}}, Precision::float32, pool);
  }
  [[nodiscard]] std::vector<Rgba> light(std::uint64_t seed) const {
    std::vector<Rgba> x = random_quads<float>(problem.grid().size(), seed, 3, 0.1);
    for (std::size_t p = 0; p < x.size(); ++p)
      if (!(problem.share[p] > 0)) x[p] = Rgba{};
    return x;
  }

  Pool pool;
  std::vector<View> views;
  Problem problem;
};

TEST_P(LevelOn, TheShareOfAKeyPointIsThatOfItsVoxels) {
  const Hull medium = march_case().medium;
  const Posed posed(medium);
  const Grid& g = posed.problem.grid();
  const Hull& hull = posed.problem.crop.hull;
  ASSERT_EQ(posed.problem.share.size(), g.size());
  std::vector<float> found(g.size());
  const auto inside = [&](int i, int j, int k) {
    const bool in = i >= 0 && j >= 0 && k >= 0 && i < g.nx - 1 && j < g.ny - 1 && k < g.nz - 1;
    return in && hull.inside[static_cast<std::size_t>(i + (g.nx - 1) * (j + (g.ny - 1) * k))] != 0;
  };
  each_point(g, [&](int i, int j, int k, std::size_t p) {
    int count = 0;
    for (int c = 0; c < 8; ++c) count += inside(i - (c & 1), j - (c >> 1 & 1), k - (c >> 2)) ? 1 : 0;
    ASSERT_EQ(posed.problem.share[p], static_cast<float>(count) / 8);
    found[p] = -1;
    ShareInside{g, hull.inside.data(), found.data()}(i, j, k);
    ASSERT_EQ(found[p], static_cast<float>(count) / 8) << "as a GPU's thread finds it";
  });
}

TEST_P(LevelOn, AFinerLevelStartsFromTheLightBetweenTheCoarserOnesKeyPoints) {
  const Hull fine = march_case().medium;
  Posed from(coarsen(fine));
  Posed to(fine);
  const auto coarse = from.engine();
  const std::vector<Rgba> x = from.light(7);
  coarse->set(x);
  const auto finer = to.engine();
  finer->start_from(*coarse);
  const std::vector<Rgba> found = finer->get();
  const Grid& f = from.problem.grid();
  const Grid& g = to.problem.grid();
  int lit = 0;
  each_point(g, [&](int i, int j, int k, std::size_t p) {
    const int at[3] = {i, j, k};
    const int points[3] = {f.nx, f.ny, f.nz};
    int cell[3];
    double part[3];
    for (int a = 0; a < 3; ++a) {
      const double place = 0.5 * (at[a] + to.problem.crop.offset[a]) - from.problem.crop.offset[a];
      cell[a] = std::clamp(static_cast<int>(std::floor(place)), 0, points[a] - 2);
      part[a] = place - cell[a];
    }
    for (std::size_t c = 0; c < 4; ++c) {
      double value = 0;
      for (int corner = 0; corner < 8; ++corner) {
        double weight = 1;
        for (int a = 0; a < 3; ++a) weight *= (corner >> a & 1) != 0 ? part[a] : 1 - part[a];
        value += weight *
                 static_cast<double>(
                     x[f.index(cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2))]
                         .c[c]);
      }
      const double expected = to.problem.share[p] > 0 ? 0.5 * value : 0;
      ASSERT_NEAR(static_cast<double>(found[p].c[c]), expected, 1e-6);
      lit += expected > 0 ? 1 : 0;
    }
  });
  EXPECT_GT(lit, 1000);

  const auto same = to.engine();
  same->start_from(*finer);
  const std::vector<Rgba> copied = same->get();
  for (std::size_t p = 0; p < copied.size(); ++p)
    for (std::size_t c = 0; c < 4; ++c) ASSERT_EQ(copied[p].c[c], found[p].c[c]);
}

TEST_P(LevelOn, ExtinctionIsExpectedBySharesAndByLight) {
  Posed posed(march_case().medium);
  const std::vector<Rgba> x = posed.light(3);
  const auto luminance_of = [](const Rgba& v) {
    return 0.299 * static_cast<double>(v.c[0]) + 0.587 * static_cast<double>(v.c[1]) +
           0.114 * static_cast<double>(v.c[2]);
  };
  double sum = 0;
  double count = 0;
  for (std::size_t p = 0; p < x.size(); ++p)
    if (posed.problem.share[p] > 0) {
      sum += luminance_of(x[p]);
      ++count;
    }
  const auto engine = posed.engine();
  for (const bool dark : {false, true}) {
    engine->set(dark ? std::vector<Rgba>(x.size()) : x);
    engine->expect_extinction(0.02F, 0.05F);
    const std::vector<Rgba> found = engine->get();
    for (std::size_t p = 0; p < x.size(); ++p) {
      const auto share = static_cast<double>(posed.problem.share[p]);
      const double density = dark ? share : std::min(6.0, luminance_of(x[p]) / (sum / count));
      ASSERT_NEAR(static_cast<double>(found[p].c[3]), share > 0 ? 0.02 * share + 0.05 * density : 0, 1e-6);
      ASSERT_EQ(found[p].c[1], dark ? 0 : x[p].c[1]) << "the light stays";
    }
  }
}

TEST_P(LevelOn, WeightsAreSettledAboveAShareOfTheirMean) {
  Posed posed(march_case().medium);
  const auto engine = posed.engine();
  std::vector<float> weights(posed.problem.grid().size());
  double sum = 0;
  int count = 0;
  for (std::size_t p = 0; p < weights.size(); ++p)
    if (posed.problem.share[p] > 0 && p % 3 != 0) {
      weights[p] = static_cast<float>(random_uniform(1, 2, p));
      sum += static_cast<double>(weights[p]);
      ++count;
    }
  engine->set_weights(weights);
  const double mean = sum / count;
  EXPECT_NEAR(static_cast<double>(engine->settle_weights(0.05F, 2)), mean, 1e-6);
  const std::vector<float> settled = engine->weights();
  for (std::size_t p = 0; p < weights.size(); ++p)
    ASSERT_NEAR(static_cast<double>(settled[p]),
                weights[p] > 0 ? 2 * (static_cast<double>(weights[p]) + 0.05 * mean) : 0, 1e-6);

  engine->set(posed.light(5));
  double extinction = 0;
  int points = 0;
  for (const Rgba& v : engine->get()) extinction += static_cast<double>(v.c[3]);
  for (const float s : posed.problem.share) points += s > 0 ? 1 : 0;
  EXPECT_NEAR(static_cast<double>(engine->take_reference()), extinction / points, 1e-6);
}

TEST_P(LevelOn, WhatIsAimedAtIsTheSlopeByTheExtinctionBeforeABackground) {
  Posed posed(march_case().medium, 1);
  const auto engine = posed.engine();
  const std::vector<Rgba> x = posed.light(11);
  const auto shown = [&](float more) {  // background included
    std::vector<Rgba> volume = x;
    for (std::size_t p = 0; p < x.size(); ++p)
      if (posed.problem.share[p] > 0) volume[p].c[3] += more;
    engine->set(volume);
    engine->project(0);
    std::vector<Rgba> radiance = engine->residuals();
    for (std::size_t r = 0; r < radiance.size(); ++r)
      for (std::size_t c = 0; c < 3; ++c)
        radiance[r].c[c] += radiance[r].c[3] * posed.problem.background[r].c[c];
    return radiance;
  };
  constexpr float kRise = 0.01F;
  const std::vector<Rgba> after = shown(kRise);
  const std::vector<Rgba> before = shown(0);
  engine->thicken(kRise);
  engine->project(0);
  engine->aim_at_residuals();
  engine->rest();
  engine->project(0);
  engine->aim_at_slope(kRise);
  engine->residual_against_aim(0, Engine::Behind::background);
  const std::vector<Rgba> slope = engine->residuals();
  double largest = 0;
  for (std::size_t r = 0; r < slope.size(); ++r)
    for (std::size_t c = 0; c < 3; ++c) {
      const double expected = (static_cast<double>(after[r].c[c]) - static_cast<double>(before[r].c[c])) /
                              static_cast<double>(kRise);
      ASSERT_NEAR(static_cast<double>(slope[r].c[c]), expected, 2e-2);
      largest = std::max(largest, std::abs(expected));
    }
  EXPECT_GT(largest, 10);
  EXPECT_EQ(engine->get().front().c[0], x.front().c[0]) << "x stays";
}

/// On a GPU a sweep is recorded and repeated: in whatever order, with whatever momentum, its bits are those
/// of its steps.
TEST_P(LevelOn, ASweepIsItsStepsOneAfterTheOther) {
  for (const int subsets : {2, 3})
    for (const bool field : {false, true}) {
      Posed posed(march_case().medium, subsets);
      const auto begin = [&] {
        auto engine = posed.engine(field ? Absorb::field : Absorb::nothing);
        const std::size_t points = posed.problem.grid().size();
        engine->set(posed.light(2));
        engine->set_weights(std::vector<float>(points, 400));
        engine->stiffen(1, 0.5F);
        if (field) {
          engine->take_reference();
          engine->set_field(std::vector<float>(points, 1e7F), std::vector<float>(points, 0.05F));
        }
        return engine;
      };
      const auto swept = begin();
      const auto stepped = begin();
      const Engine::FieldStep joint{{}, 1e3F, 0.01F, 0.3F};
      for (int pass = 0; pass < 6; ++pass) {
        std::vector<Engine::SubsetStep> steps;
        for (int s = 0; s < subsets; ++s)
          steps.push_back(
              {s,
               {static_cast<float>(subsets), pass == 0 ? 0.F : 0.3F + 0.1F * static_cast<float>(pass + s),
                pass == 4 ? 0.5F : 1.F}});
        swept->sweep(steps, field ? &joint : nullptr);
        for (const Engine::SubsetStep& step : steps) {
          stepped->residual(step.subset);
          stepped->backproject(step.subset);
          if (field) {
            Engine::FieldStep both = joint;
            both.emission = step.step;
            stepped->descend_field(both);
          } else {
            stepped->descend(step.step);
          }
        }
        const std::vector<Rgba> a = swept->get();
        const std::vector<Rgba> b = stepped->get();
        for (std::size_t p = 0; p < a.size(); ++p)
          for (std::size_t c = 0; c < 4; ++c)
            ASSERT_EQ(a[p].c[c], b[p].c[c]) << "pass " << pass << ", " << subsets;
      }
    }
}

TEST_P(LevelOn, WhatIsDoneAtOnceIsDoneOnceEachAndItsFirstErrorComesBack) {
  Pool pool(2, device_here());
  std::array<std::atomic<int>, 6> calls{};
  at_once(pool, 6, [&](int n) { ++calls[static_cast<std::size_t>(n)]; });
  for (const std::atomic<int>& count : calls) EXPECT_EQ(count, 1);
  at_once(pool, 0, [&](int) { FAIL(); });
  EXPECT_THROW(at_once(pool, 4,
                       [](int n) {
                         if (n > 1) throw std::out_of_range(std::to_string(n));
                       }),
               std::out_of_range);

  Posed posed(march_case().medium);
  const std::vector<Rgba> x = posed.light(4);
  const auto shown = [&](int n) {
    const auto engine = posed.engine(Absorb::nothing);
    engine->set(x);
    for (int pass = 0; pass <= n; ++pass) engine->residual(pass % 2);
    return engine->squares(0, posed.problem.rays());
  };
  std::array<ResidualEngine::Squares, 4> together{};
  at_once(posed.pool, 4, [&](int n) { together[static_cast<std::size_t>(n)] = shown(n); });
  for (int n = 0; n < 4; ++n) EXPECT_EQ(together[static_cast<std::size_t>(n)], shown(n));
}

}  // namespace
}  // namespace emberlock::recon
