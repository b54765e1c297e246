// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/volume_flow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace emberlock::recon {
namespace {

struct Blob {
  std::array<double, 3> at, move;  // key points
  double width = 5;
  double light = 1;
};

/// The blobs after so many steps, over 57 x 41 x 73 key points of 2 mm.
Volume show(const std::vector<Blob>& blobs, double steps) {
  const Grid grid{{0.1F, -0.2F, 0.3F}, 0.002F, 57, 41, 73};
  Volume volume{grid, std::vector<float>(3 * grid.size()), std::vector<float>(grid.size())};
  for (int k = 0; k < grid.nz; ++k)
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i)
        for (const Blob& b : blobs) {
          const double place[3] = {static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)};
          double squared = 0;
          for (std::size_t a = 0; a < 3; ++a)
            squared += std::pow((place[a] - b.at[a] - steps * b.move[a]) / b.width, 2);
          if (squared > 9) continue;
          const std::size_t p = grid.index(i, j, k);
          const double value = b.light * (std::exp(-0.5 * squared) - std::exp(-4.5));
          const double colours[] = {3000, 2000, 500};
          for (std::size_t c = 0; c < 3; ++c)
            volume.emission[3 * p + c] += static_cast<float>(colours[c] * value);
          volume.extinction[p] += static_cast<float>(20 * value);
        }
  return volume;
}

double difference(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += std::pow(static_cast<double>(a[i]) - static_cast<double>(b[i]), 2);
  return std::sqrt(sum);
}

/// What is left of the difference from now to the next step when the volume is carried on by the flow that
/// the last step shows.
void expect_carried(const std::vector<Blob>& blobs, double most_left) {
  Pool pool(2);
  const Volume before = show(blobs, -1);
  const Volume now = show(blobs, 0);
  const Volume next = show(blobs, 1);
  const Volume found = carried(now, find_flow(before, now, pool), pool);
  EXPECT_LT(difference(found.emission, next.emission), most_left * difference(now.emission, next.emission));
  EXPECT_LT(difference(found.extinction, next.extinction),
            most_left * difference(now.extinction, next.extinction));
}

TEST(VolumeFlow, CarriesALightThatMovesAsAWhole) {
  expect_carried({{{28, 20, 30}, {0.6, 0, 0.3}}}, 0.25);
  expect_carried({{{28, 20, 30}, {1.7, -0.6, 2.3}}}, 0.25);
  expect_carried({{{28, 20, 22}, {0, 0, 6}}}, 0.25);  // further than it is wide
}

TEST(VolumeFlow, CarriesPartsThatMoveApart) {
  expect_carried({{{16, 20, 20}, {0, 0, 2.5}}, {{40, 20, 50}, {-1, 1, -2}, 5, 0.6}}, 0.35);
}

TEST(VolumeFlow, WhereNothingMovesOrNothingIsEverythingStays) {
  Pool pool(2);
  const Volume still = show({{{28, 20, 30}, {0, 0, 0}}}, 0);
  const Volume found = carried(still, find_flow(still, still, pool), pool);
  EXPECT_LT(difference(found.emission, still.emission),
            1e-4 * difference(still.emission, std::vector<float>(still.emission.size())));
  const Volume dark = show({}, 0);
  EXPECT_EQ(carried(dark, find_flow(dark, dark, pool), pool).emission, dark.emission);
  // Light that appears, and light that goes out.
  for (const auto& [before, after] : {std::pair(dark, still), std::pair(still, dark)}) {
    const VolumeFlow flow = find_flow(before, after, pool);
    EXPECT_TRUE(std::all_of(flow.move.begin(), flow.move.end(), [](float v) { return std::isfinite(v); }));
  }
}

TEST(VolumeFlow, HasTheSameBitsForAnyNumberOfThreads) {
  const std::vector<Blob> blobs = {{{16, 20, 20}, {0, 0, 2.5}}, {{40, 20, 50}, {-1, 1, -2}}};
  Pool one(1);
  Pool three(3);
  const VolumeFlow flow = find_flow(show(blobs, 0), show(blobs, 1), one);
  EXPECT_EQ(find_flow(show(blobs, 0), show(blobs, 1), three).move, flow.move);
  EXPECT_EQ(carried(show(blobs, 0), flow, three).emission, carried(show(blobs, 0), flow, one).emission);
}

TEST(VolumeFlow, OneVoxelIsAVolumeToo) {
  const Grid grid{{0, 0, 0}, 0.1F, 2, 2, 2};
  Pool pool(1);
  const Volume small{grid, std::vector<float>(24, 5), {}};
  const Volume found = carried(small, find_flow(small, small, pool), pool);
  EXPECT_EQ(found.emission, small.emission);
  EXPECT_TRUE(found.extinction.empty());
}

}  // namespace
}  // namespace emberlock::recon
