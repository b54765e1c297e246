// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "base/random.h"
#include "recon/kernels/grid.h"
#include "recon/kernels/update.h"
#include "tests/support/devices.h"
#include "tests/support/marches.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(UpdateLaw);

/// Some light on a small grid, a part of it dark.
struct Case {
  Grid grid;
  double most = 1, soft = 1;
  std::vector<Rgba64> y;
  std::vector<double> weights;  // 0 where no ray comes, which is dark then
};

Case random_case() {
  Case c;
  c.grid.nx = *rc::gen::inRange(2, 7);
  c.grid.ny = *rc::gen::inRange(2, 7);
  c.grid.nz = *rc::gen::inRange(2, 7);
  c.most = std::pow(10, *rc::gen::inRange(-30, 31) / 10.0);
  c.soft = std::pow(10, *rc::gen::inRange(-30, 11) / 10.0);
  const int seed = *rc::gen::inRange(0, 1'000'000);
  c.y.resize(c.grid.size());
  for (std::size_t p = 0; p < c.y.size(); ++p)
    for (std::uint64_t lane = 0; lane < 4; ++lane)
      c.y[p].c[lane] = std::max(0.0, random_uniform(static_cast<std::uint64_t>(seed), p, lane) - 0.3);
  c.weights.resize(c.y.size());
  for (std::size_t p = 0; p < c.y.size(); ++p) {
    if (random_uniform(static_cast<std::uint64_t>(seed), p, 4) < 0.8)
      c.weights[p] = 1e-9 * c.most;
    else
      c.y[p] = {};
  }
  return c;
}

/// |grad y| at every key point, from its definition.
std::vector<double> steepness(const Grid& g, const std::vector<Rgba64>& y) {
  const auto light = [&](int i, int j, int k) {
    const bool inside = i >= 0 && j >= 0 && k >= 0 && i < g.nx && j < g.ny && k < g.nz;
    return inside ? y[g.index(i, j, k)] : Rgba64{};
  };
  std::vector<double> all;
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) {
        double sum = 0;
        for (int c = 0; c < 3; ++c)
          for (int side : {-1, 1}) {
            const double here = light(i, j, k).c[c];
            sum += std::pow(here - light(i + side, j, k).c[c], 2) / 6;
            sum += std::pow(here - light(i, j + side, k).c[c], 2) / 6;
            sum += std::pow(here - light(i, j, k + side).c[c], 2) / 6;
          }
        all.push_back(std::sqrt(sum));
      }
  return all;
}

double variation(const Case& c, const std::vector<Rgba64>& y) {
  double sum = 0;
  for (const double g : steepness(c.grid, y)) sum += g < c.soft ? g * g / 2 : c.soft * (g - c.soft / 2);
  return sum;
}

std::vector<double> stiffened(const Case& c) {
  std::vector<double> stiffness(c.y.size());
  step_on(device_here(),
          Stiffen<double>{c.grid, c.weights.data(), c.y.data(), stiffness.data(), c.most, c.soft});
  return stiffness;
}

TEST_P(UpdateLaw, TiesAreFirmWhereLightIsEvenAndSoftenAcrossEdges) {
  EXPECT_TRUE(rc::check("stiffness = most / 2 min(1, soft / |grad y|)", [] {
    const Case c = random_case();
    const std::vector<double> stiffness = stiffened(c);
    const std::vector<double> steep = steepness(c.grid, c.y);
    for (std::size_t p = 0; p < steep.size(); ++p) {
      const double expected = c.weights[p] > 0 ? c.most / 2 * std::min(1.0, c.soft / steep[p]) : 0;
      RC_ASSERT(std::abs(stiffness[p] - expected) <= 1e-12 * c.most);
    }
  }));
}

TEST_P(UpdateLaw, AStepThatNoPictureAsksForNeverRaisesTheVariation) {
  EXPECT_TRUE(rc::check("the parabola majorises the Huber variation", [] {
    const Case c = random_case();
    const Grid& g = c.grid;
    const std::vector<double> stiffness = stiffened(c);
    std::vector<Rgba64> x = c.y, next = c.y, gradient(g.size());
    step_on(device_here(), Descend<double>{g, c.weights.data(), x.data(), c.y.data(), next.data(),
                                           gradient.data(), stiffness.data(), 1.0, 0.0});
    const double before = variation(c, c.y);
    if (before > 1e-9) {
      RC_ASSERT(variation(c, x) < before);
    }
    for (std::size_t p = 0; p < x.size(); ++p) RC_ASSERT(x[p].c[3] == c.y[p].c[3]);
  }));
}

}  // namespace
}  // namespace emberlock::recon
