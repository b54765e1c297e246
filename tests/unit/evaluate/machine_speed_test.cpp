// SPDX-License-Identifier: Apache-2.0
#include "evaluate/machine_speed.h"

#include <limits>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "base/file.h"

namespace emberlock::evaluate {
namespace {
using testing::HasSubstr;

constexpr FrameTimes kFrame{Seconds(0.5), Seconds(1.25)};

TEST(MachineSpeed, ARigsDataAndMinutesFollowFromItsSizeAndRate) {
  const PlannedRig rig{.cameras = 4, .size = {1000, 500}, .rate = 20, .bytes_per_pixel = 2, .voxels = 64};
  const auto expected = expectation(rig, 240e6, kFrame);
  ASSERT_TRUE(expected.ok());
  EXPECT_DOUBLE_EQ(expected->bytes_per_s, 80e6);
  EXPECT_EQ(expected->cameras_recorded, 8);  // 20 MB/s each, and half as much to spare
  EXPECT_TRUE(expected->recorded);
  EXPECT_DOUBLE_EQ(expected->seconds_per_second, 25);
}

TEST(MachineSpeed, ADiskThatIsTooSlowIsSaid) {
  const PlannedRig rig{.cameras = 9, .size = {1000, 500}, .rate = 20, .bytes_per_pixel = 2, .voxels = 64};
  EXPECT_FALSE(expectation(rig, 240e6, kFrame)->recorded);
  EXPECT_EQ(expectation(rig, 1, kFrame)->cameras_recorded, 0);
  EXPECT_GT(expectation(rig, 1e300, kFrame)->cameras_recorded, 9);
}

TEST(MachineSpeed, WhatIsNoSpeedIsAnError) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  for (const double disk : {0.0, -1.0, nan, infinite})
    EXPECT_EQ(expectation({}, disk, kFrame).error().kind, ErrorKind::not_converged) << disk;
  for (const double time : {0.0, -1.0, nan, infinite}) {
    EXPECT_EQ(expectation({}, 1e8, {Seconds(time), Seconds(1)}).error().kind, ErrorKind::not_converged);
    EXPECT_EQ(expectation({}, 1e8, {Seconds(1), Seconds(time)}).error().kind, ErrorKind::not_converged);
  }
}

TEST(MachineSpeed, ARigThatCannotBeNamesItsOption) {
  const auto refused = [](void (*spoil)(PlannedRig&)) {
    PlannedRig rig;
    spoil(rig);
    const Status status = check(rig);
    return status.ok() ? std::string() : status.error().message();
  };
  EXPECT_TRUE(check({}).ok());
  EXPECT_THAT(refused([](PlannedRig& r) { r.cameras = 1; }), HasSubstr("--cameras"));
  EXPECT_THAT(refused([](PlannedRig& r) { r.size.width = 0; }), HasSubstr("--size"));
  EXPECT_THAT(refused([](PlannedRig& r) { r.size.height = -480; }), HasSubstr("--size"));
  EXPECT_THAT(refused([](PlannedRig& r) { r.rate = std::numeric_limits<double>::quiet_NaN(); }),
              HasSubstr("--fps"));
  EXPECT_THAT(refused([](PlannedRig& r) { r.bytes_per_pixel = 0; }), HasSubstr("--bytes-per-pixel"));
  EXPECT_THAT(refused([](PlannedRig& r) { r.voxels = 4096; }), HasSubstr("--voxels"));
}

TEST(MachineSpeed, AFrameIsTimedOnWhatTheRigWouldFilm) {
  const PlannedRig rig{.cameras = 4, .size = {48, 36}, .rate = 24, .bytes_per_pixel = 1, .voxels = 16};
  const SteadyClock clock;
  double last = 0;
  const auto times =
      time_frame(rig, {recon::Device::cpu, 1}, 1, clock, [&](double done, std::string_view) { last = done; });
  ASSERT_TRUE(times.ok()) << times.error().message();
  EXPECT_TRUE(expectation(rig, 1e8, *times).ok());
  EXPECT_DOUBLE_EQ(last, 1);
}

/// The same figures as in the code, in the README's own words.
TEST(MachineSpeed, TheReadmesTableHoldsTheSameFigures) {
  const auto readme = read_file(std::string(EMBERLOCK_SOURCE_DIR) + "/README.md");
  ASSERT_TRUE(readme.ok());
  const MachineSpeed machine = readme_machine();
  const auto row = [&](std::string_view words, double value, std::string_view unit) {
    const std::size_t at = readme->find(words);
    ASSERT_NE(at, std::string::npos) << words;
    EXPECT_THAT(readme->substr(at, readme->find('\n', at) - at),
                testing::EndsWith(fmt::format("| {:g} {} |", value, unit)));
  };
  row("| disk, with", machine.disk / 1e6, "MB/s");
  row("| CPU: a frame, extinction told", machine.cpu.told.value(), "s");
  row("| CPU: a frame, effects found out", machine.cpu.found.value(), "s");
  ASSERT_TRUE(machine.cuda);
  row("| GPU: a frame, extinction told", machine.cuda->told.value(), "s");
  row("| GPU: a frame, effects found out", machine.cuda->found.value(), "s");
}

}  // namespace
}  // namespace emberlock::evaluate
