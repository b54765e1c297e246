// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/radiant.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/key_points.h"

namespace emberlock::recon {
namespace {

constexpr double kSigma = 5.670374419e-8;
constexpr double kPi = 3.14159265358979;

HotVolume ball(double radius, double kelvin, double absorption, int voxels = 48) {
  HotVolume v{cube_grid(2.2 * radius, voxels), {}, {}};
  each_point(v.grid, [&](int i, int j, int k) {
    const double inside = share_in_ball(v.grid, i, j, k, radius);
    v.kelvin.push_back(inside > 0 ? static_cast<float>(kelvin) : 0);
    v.absorption.push_back(static_cast<float>(inside * absorption));
  });
  return v;
}

TEST(RadiantSlow, AnIsothermalBallRadiatesTheClosedForm) {
  for (const double radius : {0.01, 0.1, 3.0})
    for (const double depth : {0.05, 0.5, 2.0}) {
      const double t = depth;
      const double share = 1 - (1 - (1 + 2 * t) * std::exp(-2 * t)) / (2 * t * t);
      const double expected = 4 * kPi * radius * radius * kSigma * std::pow(1500, 4) * share;
      EXPECT_NEAR(radiated_power(ball(radius, 1500, depth / radius)), expected, 0.02 * expected)
          << radius << " m, " << depth;
    }
}

TEST(Radiant, FluxFarAwayIsThePowerOverTheSphere) {
  const HotVolume v = ball(0.1, 1200, 5);
  const double power = radiated_power(v);
  const double distance = 0.5;
  const double flux = radiant_flux(v, {0, 0, -distance}, {0, 0, 1});
  EXPECT_NEAR(flux, power / (4 * kPi * distance * distance), 0.04 * flux);
  EXPECT_EQ(radiant_flux(v, {0, 0, -distance}, {0, 0, -1}), 0) << "looking away";
}

TEST(Radiant, FluxVeryFarAwayToo) {
  const HotVolume v = ball(0.1, 1200, 5, 24);
  const double share = radiated_power(v) / (4 * kPi * 100 * 100);
  EXPECT_NEAR(radiant_flux(v, {60, 0, 80}, {-0.6, 0, -0.8}), share, 0.02 * share);
  const Eigen::Vector3d oblique = Eigen::Vector3d(-1, 0, -1).normalized();
  EXPECT_NEAR(radiant_flux(v, {60, 0, 80}, oblique), share * 1.4 / std::sqrt(2), 0.02 * share);
}

TEST(RadiantSlow, ASphereAroundTheBallCatchesAllItsPower) {
  const double depth = 0.5;
  const double share = 1 - (1 - (1 + 2 * depth) * std::exp(-2 * depth)) / (2 * depth * depth);
  const double power = 4 * kPi * 0.1 * 0.1 * kSigma * std::pow(1500, 4) * share;
  for (const double radius : {0.12, 0.15, 0.5}) {
    const SphereFlux flux = radiant_flux(ball(0.1, 1500, depth / 0.1, 24), TargetSphere{{0, 0, 0}, radius});
    EXPECT_NEAR(flux.power, power, 0.02 * power) << radius;
    EXPECT_NEAR(flux.mean, power / (4 * kPi * radius * radius), 0.02 * flux.mean) << radius;
    EXPECT_NEAR(flux.most, flux.mean, 0.05 * flux.mean) << radius;
  }
  // Not concentric: not even, but all of it.
  const SphereFlux beside = radiant_flux(ball(0.1, 1500, depth / 0.1, 24), TargetSphere{{0.2, 0, 0.1}, 0.5});
  EXPECT_NEAR(beside.power, power, 0.02 * power);
  EXPECT_GT(beside.most, 1.5 * beside.mean);
}

TEST(Radiant, ASmallFarSphereGetsTheInverseSquareShare) {
  const HotVolume v = ball(0.1, 1200, 5, 24);
  const double distance = 5;
  const double radius = 0.05;
  const double most = radiated_power(v) / (4 * kPi * distance * distance);
  const SphereFlux flux = radiant_flux(v, TargetSphere{{0, 3, -4}, radius});
  EXPECT_NEAR(flux.power, most * kPi * radius * radius, 0.02 * flux.power) << "its cross-section";
  EXPECT_NEAR(flux.mean, most / 4, 0.005 * most);
  EXPECT_NEAR(flux.most, most, 0.03 * most) << "facing the flame";
}

TEST(RadiantSlow, ASphereInsideAThickBodyIsLitOnItsOuterSide) {
  const SphereFlux flux = radiant_flux(ball(0.1, 1000, 1e4, 24), TargetSphere{{0, 0, 0}, 0.02});
  EXPECT_NEAR(flux.mean, kSigma * 1e12, 0.01 * kSigma * 1e12);
  EXPECT_NEAR(flux.most, flux.mean, 0.01 * flux.mean);
}

TEST(Radiant, InsideAThickBodyTheFluxIsSigmaT4) {
  EXPECT_NEAR(radiant_flux(ball(0.1, 1000, 1e4), {0, 0, 0}, {1, 0, 0}), kSigma * 1e12, 0.01 * kSigma * 1e12);
}

TEST(Radiant, StatisticsOfABall) {
  const HotVolume v = ball(0.1, 1500, 5);
  const HotStatistics s = statistics_of(v, std::vector<float>(v.grid.size(), 20.0F), {0, 0, 1});
  EXPECT_NEAR(s.mean, 1500, 1e-6);
  EXPECT_NEAR(s.mean_error, 20, 1e-9);
  EXPECT_EQ(s.most, 1500);
  EXPECT_NEAR(s.height, 0.2, 0.01);
  EXPECT_NEAR(s.volume, 4.0 / 3 * kPi * 1e-3, 0.08 * 4.2e-3);
}

TEST(Radiant, NothingRadiatesNothing) {
  const HotVolume v = ball(0.1, 0, 0);
  EXPECT_EQ(radiated_power(v), 0);
  EXPECT_EQ(statistics_of(v, v.kelvin, {0, 0, 1}).points, 0U);
}

}  // namespace
}  // namespace emberlock::recon
