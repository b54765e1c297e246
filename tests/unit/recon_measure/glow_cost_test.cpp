// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/glow_cost.h"

#include <gtest/gtest.h>

#include "tests/support/glowing_flame.h"
#include "tests/support/march_case.h"

namespace emberlock::recon {
namespace {

const EmitterColours& colours() {
  static const EmitterColours soot(EmitterTable(test::lobes(), Emitter::soot));
  return soot;
}

constexpr GlowTies kTied{0.3, 0.2};

/// Two views of a medium with holes, of which one key point in seven doesn't glow as soot does.
class GlowCostTest : public testing::Test {
 protected:
  explicit GlowCostTest(std::uint64_t seed = 3) {
    const MarchCase c = march_case();
    for (std::size_t v = 0; v < 2; ++v) {
      RadianceImage image(c.cameras[v].intrinsics.size);
      for (std::size_t i = 0; i < image.rgb.size(); ++i)
        image.rgb[i] = static_cast<float>(3 * random_uniform(seed, v, i));
      views_.push_back(View{"v", c.cameras[v], share(std::move(image))});
    }
    medium_ = c.medium;
    problem_ = of_subsets(1);
    const std::size_t points = problem_.grid().size();
    start_.light = random_quads<float>(points, seed, 1, 0.1);
    start_.total.resize(points);
    at_ = {std::vector<double>(points), std::vector<double>(points)};
    direction_ = at_;
    for (std::size_t p = 0; p < points; ++p) {
      start_.total[p] = p % 7 == 0 ? 0 : static_cast<float>(0.5 + random_uniform(seed, 10, p));
      at_.kelvin[p] = 1300 + 900 * random_uniform(seed, 11, p);
      at_.brightness[p] = random_uniform(seed, 12, p) - 0.5;
      direction_.kelvin[p] = start_.total[p] > 0 ? 50 * random_uniform(seed, 13, p) : 0;
      direction_.brightness[p] = start_.total[p] > 0 ? random_uniform(seed, 14, p) - 0.3 : 0;
    }
  }
  [[nodiscard]] Problem of_subsets(int subsets) {
    ProblemOptions options;
    options.subsets = options.rule.dealt = subsets;
    return make_problem({&views_[0], &views_[1]}, medium_, options, pool_);
  }
  [[nodiscard]] GlowCost<double> tied(const Problem& problem, const GlowStart& start, Pool& pool) const {
    GlowCost<double> cost(problem, start, colours(), pool);
    cost.weigh(at_, kTied);
    return cost;
  }
  /// Of costs, central.
  [[nodiscard]] double difference(GlowCost<double>& cost, double way) const {
    GlowField<double> unused;
    return (cost(beyond(way), unused) - cost(beyond(-way), unused)) / (2 * way);
  }
  [[nodiscard]] GlowField<double> beyond(double way) const {
    GlowField<double> out = at_;
    for (std::size_t p = 0; p < out.kelvin.size(); ++p) {
      out.kelvin[p] += way * direction_.kelvin[p];
      out.brightness[p] += way * direction_.brightness[p];
    }
    return out;
  }
  template <class Real>
  [[nodiscard]] double along(const GlowField<Real>& slope) const {
    double sum = 0;
    for (std::size_t p = 0; p < slope.kelvin.size(); ++p)
      sum += static_cast<double>(slope.kelvin[p]) * direction_.kelvin[p] +
             static_cast<double>(slope.brightness[p]) * direction_.brightness[p];
    return sum;
  }

  Pool pool_{2};
  std::vector<View> views_;
  Hull medium_;
  Problem problem_;
  GlowStart start_;
  GlowField<double> at_, direction_;
};

constexpr Absorb kAbsorbs[] = {Absorb::nothing, Absorb::constant, Absorb::field};

/// Richardson's extrapolation of central differences of the double-precision march.
TEST_F(GlowCostTest, GradientIsExactUnderEveryExtinction) {
  for (const Absorb absorb : kAbsorbs) {
    GlowStart start = start_;
    start.absorb = absorb;
    start.sigma = 0.05;
    GlowCost<double> cost = tied(problem_, start, pool_);
    GlowField<double> slope;
    cost(at_, slope);
    const double expected = (4 * difference(cost, 1e-3) - difference(cost, 2e-3)) / 3;
    EXPECT_NEAR(along(slope) / expected, 1, 1e-7) << static_cast<int>(absorb);

    GlowCost<float> single(problem_, start, colours(), pool_);
    const GlowField<float> rounded{{at_.brightness.begin(), at_.brightness.end()},
                                   {at_.kelvin.begin(), at_.kelvin.end()}};
    GlowField<float> own;
    single.weigh(rounded, kTied);
    single(rounded, own);
    EXPECT_NEAR(along(own) / expected, 1, 1e-4) << static_cast<int>(absorb);
  }
}

TEST_F(GlowCostTest, GradientIsExactWherePixelsAreBounds) {
  start_.absorb = Absorb::field;
  start_.white = 2;  // of pictures up to 3
  GlowCost<double> cost = tied(problem_, start_, pool_);
  GlowField<double> slope;
  cost(at_, slope);
  // A residual has a kink where a bound begins to be met: the differences are only as good as few of them are
  // crossed.
  EXPECT_NEAR(along(slope) / difference(cost, 1e-5), 1, 1e-4);
}

TEST_F(GlowCostTest, IsTheSameInOnePartOrInMany) {
  for (const Absorb absorb : kAbsorbs) {
    start_.absorb = absorb;
    start_.sigma = 0.05;
    std::vector<double> costs;
    std::vector<GlowField<double>> slopes(2);
    for (const int subsets : {1, 7}) {
      const Problem problem = of_subsets(subsets);
      ASSERT_EQ(problem.list.subsets(), subsets);
      GlowCost<double> cost = tied(problem, start_, pool_);
      costs.push_back(cost(at_, slopes[costs.size()]));
    }
    EXPECT_NEAR(costs[1] / costs[0], 1, 1e-10);
    EXPECT_NEAR(along(slopes[1]) / along(slopes[0]), 1, 1e-9);
  }
}

TEST_F(GlowCostTest, AStepLowersTheCostAndMovesOnlyWhatGlows) {
  start_.absorb = Absorb::field;
  GlowCost<double> cost = tied(problem_, start_, pool_);
  GlowField<double> slope;
  GlowField<double> next = at_;
  const double before = cost(at_, slope);
  cost.descend(next, slope, 1);
  EXPECT_LT(cost(next, slope), before);
  for (std::size_t p = 0; p < next.kelvin.size(); p += 7) ASSERT_EQ(next.kelvin[p], at_.kelvin[p]);
}

TEST_F(GlowCostTest, HasTheSameBitsForEveryNumberOfThreads) {
  start_.absorb = Absorb::field;
  std::vector<double> costs;
  std::vector<GlowField<double>> slopes(2);
  for (const int threads : {1, 3}) {
    Pool pool(threads);
    GlowCost<double> cost = tied(problem_, start_, pool);
    costs.push_back(cost(at_, slopes[costs.size()]));
  }
  EXPECT_EQ(costs[0], costs[1]);
  EXPECT_EQ(slopes[0].kelvin, slopes[1].kelvin);
  EXPECT_EQ(slopes[0].brightness, slopes[1].brightness);
}

TEST(EmitterColours, AreTheTablesAndTheirSlopeIsTheirs) {
  const EmitterTable table(test::lobes(), Emitter::soot);
  for (const double kelvin : {501.0, 900.0, 1500.0, 2356.0, 5990.0}) {
    const EmitterColours::At at = colours().at(kelvin);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_NEAR(at.value[c], table.at(Kelvin(kelvin)).value[c], 1e-4) << kelvin;
      constexpr double kWay = 1e-3;
      const double slope =
          (colours().at(kelvin + kWay).value[c] - colours().at(kelvin - kWay).value[c]) / (2 * kWay);
      EXPECT_NEAR(at.slope[c], slope, 1e-9) << kelvin;
    }
  }
  EXPECT_EQ(colours().at(100).slope[0], 0) << "colder than the table";
}

}  // namespace
}  // namespace emberlock::recon
