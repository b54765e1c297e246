// SPDX-License-Identifier: Apache-2.0
#include "recon/render/in_scatter.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "recon/hull/hull.h"
#include "tests/support/devices.h"
#include "tests/support/random_walks.h"

namespace emberlock {
namespace {

ON_EACH_DEVICE(InScatter);

TEST_P(InScatter, AgreesWithRandomWalksThroughACloud) {
  // Four deviations of the walks, and what 12 voxels make of blobs of less than two voxels' width.
  constexpr double kDiscretisation = 0.045;
  constexpr double kThickest = 30;
  constexpr int kWalks = 15000;
  const recon::Volume volume = cloud(24, kThickest);
  const Eigen::Vector3d camera(0.28, 0.1, 0.05);
  recon::InScatterOptions options;
  options.voxels = 12;
  recon::Pool pool(0, device_here());
  const recon::Scattering cases[] = {{Order::single, 0.9, 0},      {Order::multiple, 0.9, 0},
                                     {Order::single, 0.9, 0.6},    {Order::multiple, 0.9, 0.6},
                                     {Order::multiple, 0.9, -0.4}, {Order::multiple, 0.9, 0.9}};
  for (const recon::Scattering& s : cases) {
    const recon::ScatterField field =
        scatter_field(volume, scattering_field(s.order, s.albedo, s.asymmetry), pool, options);
    const std::vector<recon::Rgba> found = recon::in_scattered(field, camera, pool);
    for (const auto& [i, j, k] :
         {std::array{6, 6, 6}, std::array{3, 7, 8}, std::array{9, 4, 4}, std::array{0, 6, 6}}) {
      const Eigen::Vector3d p = place_of(field.medium.grid, i, j, k);
      const Estimate truth =
          RandomWalks{volume, kThickest, s}.in_scatter(p, (camera - p).normalized(), kWalks);
      EXPECT_NEAR(green(found, field.medium.grid.index(i, j, k)), truth.mean,
                  4 * truth.deviation + kDiscretisation * truth.mean)
          << "g " << s.asymmetry << ", order " << static_cast<int>(s.order) << ", key point " << i;
    }
  }
}

TEST_P(InScatter, FinerGridsComeCloserToRandomWalks) {
  const recon::Volume volume = cloud(24, 30);
  const recon::Effects effects = scattering_field(Order::single, 0.9);
  const Eigen::Vector3d at(0.05, -0.0333333333333333333,
                           -0.0333333333333333333);  // key point (9, 4, 4) of 12
  const Estimate truth =
      RandomWalks{volume, 30, effects.scattering}.in_scatter(at, Eigen::Vector3d::UnitX(), 100000);
  recon::Pool pool(0, device_here());
  double error[2];
  for (const int voxels : {12, 24}) {
    recon::InScatterOptions options;
    options.voxels = voxels;
    const recon::ScatterField field = scatter_field(volume, effects, pool, options);
    const int scale = voxels / 12;
    error[scale - 1] = green(recon::in_scattered(field, {1, 0, 0}, pool),
                             field.medium.grid.index(9 * scale, 4 * scale, 4 * scale)) -
                       truth.mean;
  }
  EXPECT_LT(std::abs(error[1]), 4 * truth.deviation + 0.01 * truth.mean);
  EXPECT_GT(std::abs(error[0]), std::abs(error[1]));
}

// ---- What is left out, limits, hard cases

TEST_P(InScatter, NothingRunsWhereNothingScatters) {
  const recon::Grid grid = cube_grid(0.2, 4);
  const recon::Volume volume = uniform_volume(grid, 100);
  recon::Hull nothing = recon::whole_grid(grid);
  nothing.inside.assign(nothing.inside.size(), 0);
  nothing.count = 0;
  recon::Pool pool(0, device_here());
  const recon::Effects on = scattering(PerMeter(30), Order::multiple, 0.5);
  EXPECT_FALSE(scatter_field(volume, on, pool).empty());
  EXPECT_TRUE(recon::find_in_scatter(volume, nothing, on, {}, pool).empty());
  for (const recon::Effects& off :
       {scattering(PerMeter(30), Order::none, 0.5), scattering(PerMeter(30), Order::multiple, 0),
        scattering(PerMeter(0), Order::multiple, 0.5)}) {
    const recon::ScatterField field = scatter_field(volume, off, pool);
    EXPECT_TRUE(field.empty());
    EXPECT_TRUE(field.ordinates.empty() && field.medium.shine.empty());
    EXPECT_EQ(greatest(recon::in_scattered(field, {1, 0, 0}, pool)), 0);
  }
}

TEST_P(InScatter, MultipleScatteringTendsToSingleAsTheAlbedoVanishes) {
  const recon::Volume volume = cloud(8, 30);
  recon::Pool pool(0, device_here());
  for (const double g : {0.0, 0.5}) {
    const auto found = [&](Order order, double albedo) {
      return recon::in_scattered(scatter_field(volume, scattering_field(order, albedo, g), pool), {1, 0, 0},
                                 pool);
    };
    const std::vector<recon::Rgba> single = found(Order::single, 1e-6);
    const std::vector<recon::Rgba> multiple = found(Order::multiple, 1e-6);
    const std::vector<recon::Rgba> strong = found(Order::multiple, 0.9);
    for (std::size_t i = 0; i < single.size(); ++i)
      EXPECT_NEAR(green(multiple, i), green(single, i), 1e-5 * greatest(single));
    EXPECT_GT(greatest(strong), 1.3 * greatest(single));
  }
}

TEST_P(InScatter, ErrorBoundHoldsAndAlmostWhiteThickMediaConverge) {
  const recon::Volume volume = cloud(10, 60);
  recon::Pool pool(0, device_here());
  for (const double asymmetry : {0.0, 0.8, -0.8}) {
    const recon::Effects effects = scattering_field(Order::multiple, 0.999, asymmetry);
    recon::InScatterOptions options;
    options.octant_levels = 2;
    options.tolerance = 0.03;
    const recon::ScatterField rough = scatter_field(volume, effects, pool, options);
    options.tolerance = 1e-4;
    const recon::ScatterField exact = scatter_field(volume, effects, pool, options);
    EXPECT_LE(rough.error_bound, 0.03);
    EXPECT_LE(exact.error_bound, 2e-4);  // rounding adds to what the recurrence says
    EXPECT_LT(exact.iterations, 60) << asymmetry;
    const std::vector<recon::Rgba> a = recon::in_scattered(rough, {0.5, 0, 0}, pool);
    const std::vector<recon::Rgba> b = recon::in_scattered(exact, {0.5, 0, 0}, pool);
    double worst = 0;
    for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(green(a, i) - green(b, i)));
    EXPECT_LE(worst / greatest(b), rough.error_bound + exact.error_bound) << asymmetry;
  }
}

TEST_P(InScatter, HardCasesStayFiniteAndNonNegative) {
  recon::Pool pool(0, device_here());
  const recon::Box needle{Eigen::Vector3d::Zero(), {0.02, 0.2, 0.02}};
  for (const recon::Grid& grid : {cube_grid(0.2, 1), cube_grid(0.2, 6), recon::grid_over(needle, 10)}) {
    const recon::Volume volume = uniform_volume(grid, 1000);
    recon::Hull checked = recon::whole_grid(grid);
    checked.count = 0;
    for (std::size_t i = 0; i < checked.inside.size(); ++i)
      checked.count += checked.inside[i] = i % 3 == 0 ? 1 : 0;
    for (const double sigma : {1e-6, 32.8, 1e6, 1e12})
      for (const double g : {0.0, 0.99, -0.99, 1.0, -1.0})
        for (const double albedo : {0.999, 1.0}) {
          recon::InScatterOptions options;
          options.octant_levels = 2;
          options.max_iterations = 20;
          const recon::ScatterField field = recon::find_in_scatter(
              volume, checked, scattering(PerMeter(sigma), Order::multiple, albedo, g), options, pool);
          ASSERT_TRUE(std::isfinite(field.error_bound));
          for (const Eigen::Vector3d& camera :
               {Eigen::Vector3d(0.3, 0, 0), place_of(field.medium.grid, 0, 0, 0)})
            for (const recon::Rgba& v : recon::in_scattered(field, camera, pool))
              for (int c = 0; c < 4; ++c)
                ASSERT_TRUE(v.c[c] >= 0 && std::isfinite(v.c[c])) << sigma << ' ' << g << ' ' << albedo;
        }
  }
}

TEST_P(InScatter, SameBitsForAnyNumberOfThreads) {
  const recon::Volume volume = cloud(7, 30);
  for (const double g : {0.0, 0.9}) {
    const recon::Effects effects = scattering_field(Order::multiple, 0.9, g);
    std::vector<recon::Rgba> first;
    for (const int threads : {1, 2, 16}) {
      recon::Pool pool(threads, device_here());
      const std::vector<recon::Rgba> found =
          recon::in_scattered(scatter_field(volume, effects, pool), {0.3, 0.1, 0}, pool);
      if (first.empty()) first = found;
      for (std::size_t i = 0; i < found.size(); ++i)
        for (std::size_t c = 0; c < 4; ++c) ASSERT_EQ(found[i].c[c], first[i].c[c]) << threads;
    }
  }
}

}  // namespace
}  // namespace emberlock
