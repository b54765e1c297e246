// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/crystal.h"

#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "drivers/virtual/virtual_clock.h"
#include "drivers/virtual/virtual_rig.h"

namespace emberlock::drivers {
namespace {

TimePoint after(double seconds) { return TimePoint{} + Seconds(seconds); }

TEST(CrystalThreads, WandersWithinAnHourByWhatItIsToldInTheMean) {
  double squared = 0;
  constexpr int kCrystals = 2000;
  for (std::uint64_t seed = 0; seed < kCrystals; ++seed) {
    const Crystal crystal(PartsPerMillion(2), seed);
    const double change = (crystal.rate(after(20000)) - crystal.rate(after(16400))).value();
    squared += change * change / kCrystals;
  }
  EXPECT_NEAR(std::sqrt(squared), 2, 0.1);
}

TEST(CrystalThreads, GoesAheadByTheIntegralOfItsRate) {
  const Crystal crystal(PartsPerMillion(3), 7);
  double sum = 0;
  for (int s = 0; s < 4000; ++s) sum += crystal.rate(after(s + 0.5)).value();
  EXPECT_NEAR(in_microseconds(crystal.ahead(after(4000)) - crystal.ahead(after(0))), sum, 1e-3);
  EXPECT_EQ(Crystal(PartsPerMillion(0), 7).ahead(after(4000)), Seconds(0));
}

TEST(CrystalThreads, TimesTheFramesOfItsCamera) {
  const auto start_after = [](PartsPerMillion wander, double seconds) {
    VirtualRigDraw draw;
    draw.cameras = 1;
    draw.layout.size = {32, 24};
    draw.row_time = microseconds_per_row(1000);
    VirtualRigOptions options = draw_virtual_rig(draw);
    options.cameras[0].first_phase = Seconds(0);
    options.cameras[0].wander = wander;
    const auto rig = VirtualRig::create(options, std::make_shared<VirtualClock>()).value();
    EXPECT_TRUE(rig->camera(0).start().ok());
    rig->clock().sleep_until(after(seconds));
    rig->camera(0).pass_over(after(seconds));
    const Frame frame = rig->camera(0).next_frame(Seconds(1)).value();
    const TimePoint read = rig->read_start(0, frame.stamp.frame_id);
    EXPECT_EQ(rig->read_start_after(0, read - milliseconds(1)), read);
    EXPECT_GE(frame.stamp.monotonic_time, after(seconds));
    EXPECT_LT(frame.stamp.monotonic_time, after(seconds + 0.1));
    return std::pair(frame.stamp.frame_id, read);
  };
  const auto [steady_id, steady] = start_after(PartsPerMillion(0), 3000);
  const auto [id, wandered] = start_after(PartsPerMillion(10), 3000);
  const Seconds apart =
      wandered - steady - (1 / 23.976) * Seconds(static_cast<double>(id) - static_cast<double>(steady_id));
  EXPECT_GT(abs(apart), microseconds(10));
  EXPECT_LT(abs(apart), milliseconds(30)) << "10 ppm for most of an hour";
}

}  // namespace
}  // namespace emberlock::drivers
