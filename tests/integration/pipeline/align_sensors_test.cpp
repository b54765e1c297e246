// SPDX-License-Identifier: Apache-2.0
// CCDs, rolling and global shutters in one alignment, from pictures to phases in truth.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/align/run.h"
#include "tests/support/aligned.h"

namespace emberlock::cli {
namespace {

using test::expect_aligned_in_truth;
using test::expect_replays;
using test::small_rig;
using test::SmallBench;
using testing::HasSubstr;

constexpr auto kCcd = SensorKind::ccd;
constexpr auto kRolling = SensorKind::rolling_shutter;
constexpr auto kGlobal = SensorKind::global_shutter;

drivers::VirtualRigOptions mixed_rig(std::uint64_t seed, const std::vector<SensorKind>& sensors = {
                                                             kCcd, kRolling, kGlobal, kRolling, kGlobal}) {
  return small_rig(seed, static_cast<int>(sensors.size()), sensors);
}

class EverySensor : public testing::TestWithParam<std::vector<SensorKind>> {};

TEST_P(EverySensor, ComesWithinToleranceInTruth) {
  SmallBench bench(mixed_rig(3, GetParam()));
  bench.options.align.policy = smear::AlignPolicy::timed;
  expect_aligned_in_truth(bench);
}

INSTANTIATE_TEST_SUITE_P(AlignSensors, EverySensor,
                         testing::Values(std::vector{kRolling, kRolling, kRolling},
                                         std::vector{kGlobal, kGlobal, kGlobal},
                                         std::vector{kCcd, kRolling, kGlobal, kRolling, kGlobal}));

// What a coarse tolerance asks of a sweep must still tell whether the edge follows the strobe's step.
TEST(AlignSensors, GlobalShuttersComeWithinACoarseTolerance) {
  for (const double rows : {100.0, 200.0}) {
    SmallBench bench(mixed_rig(3, {kGlobal, kGlobal, kGlobal}));
    bench.options.align.tolerance.amount = Rows(rows);
    expect_aligned_in_truth(bench);
  }
}

TEST(AlignSensors, AMixedRigComesWithinThreeRows) {
  SmallBench bench(mixed_rig(5));
  bench.options.align.policy = smear::AlignPolicy::timed;
  bench.options.align.tolerance.amount = Rows(3);
  expect_aligned_in_truth(bench);
}

TEST(AlignSensors, TheTimeThatIsForetoldCountsTheSweepsOfShuttersThatAreReset) {
  SmallBench bench(mixed_rig(3, {kGlobal, kGlobal, kGlobal}));
  bench.options.align.policy = smear::AlignPolicy::timed;
  bench.options.align.tolerance.amount = Rows(20);
  std::optional<TimePoint> last;
  bool reset = false;
  double quiet = 0;  // seconds of rounds
  double after = 0;  // of those after resets
  int rounds[2] = {0, 0};
  smear::AlignOptions used;
  const auto result = rig::run_align(bench.align, bench.options, [&](const rig::AlignRoundReport& r) {
    if (last) {
      (reset ? after : quiet) += (r.round.at - *last).value();
      ++rounds[reset ? 1 : 0];
    }
    last = r.round.at;
    const auto& cameras = r.decision.cameras;
    reset =
        std::any_of(cameras.begin(), cameras.end(), [](const smear::CameraDecision& c) { return c.reset; });
    used = r.options;
  });
  ASSERT_TRUE(result.ok()) << result.error().message();
  ASSERT_EQ(result->last.verdict, smear::AlignVerdict::aligned) << result->words.reason;
  ASSERT_GT(rounds[0], 0);
  ASSERT_GT(rounds[1], 0);
  const double foretold_quiet = used.round_time.value() * rounds[0];
  const double foretold_after = (used.round_time + used.sweep_time).value() * rounds[1];
  EXPECT_NEAR(quiet / foretold_quiet, 1, 0.4);
  EXPECT_NEAR(after / foretold_after, 1, 0.2);
}

TEST(AlignSensors, RowTimesAndExposuresAreMeasured) {
  SmallBench bench(mixed_rig(5));
  bench.options.align.max_rounds = 1;
  const auto result = rig::run_align(bench.align, bench.options);
  ASSERT_TRUE(result.ok()) << result.error().message();
  for (int i = 0; i < bench.rig->size(); ++i) {
    const auto camera = static_cast<std::size_t>(i);
    const drivers::VirtualCameraOptions& truth = bench.rig->truth(i);
    if (truth.sensor == kRolling) {
      ASSERT_TRUE(result->row_clocks[camera]);
      const double error = (result->row_clocks[camera]->row_time - truth.timing.row_time).value();
      EXPECT_LT(std::abs(error), 3 * result->row_clocks[camera]->sigma.value());
      EXPECT_LT(std::abs(error / truth.timing.row_time.value()), 1e-3);
    }
    ASSERT_EQ(result->exposures[camera].has_value(), truth.sensor != kCcd);
    if (!truth.exposure) continue;
    const Seconds error = *result->exposures[camera] - *truth.exposure;
    EXPECT_LT(abs(error), truth.timing.frame_period / 24) << i;
  }
}

/// Aligns two cameras, one of them with this exposure; what is said of the camera that it doesn't suit.
std::string said_of(SensorKind kind, Seconds exposure, Seconds flash_width = microseconds(20)) {
  drivers::VirtualRigOptions setup = mixed_rig(4, {kind, kind});
  setup.cameras[1].exposure = exposure;
  SmallBench bench(setup);
  bench.options.align.max_looks = 1;
  bench.options.flash_width = flash_width;
  std::string said;  // in the first round: later ones sweep anew, and a drift may lead a flash into view
  const auto result = rig::run_align(bench.align, bench.options, [&](const rig::AlignRoundReport& r) {
    if (said.empty()) said = r.words.cameras[1];
  });
  EXPECT_TRUE(result.ok()) << result.error().message();
  if (!result.ok()) return result.error().message();
  EXPECT_EQ(result->last.verdict, smear::AlignVerdict::given_up);
  EXPECT_EQ(result->resets, 0);
  EXPECT_THAT(result->words.reason, HasSubstr("virtual-01"));
  return said;
}

TEST(AlignSensors, AnExposureTooLongToSeeAnEdgeIsSaidAndWhatToDo) {
  const Seconds period = small_rig(4).cameras[1].timing.frame_period;
  EXPECT_THAT(said_of(kRolling, period), HasSubstr("too long to see an edge: shorten it"));
  EXPECT_THAT(said_of(kGlobal, period), HasSubstr("shorten its exposure"));
}

TEST(AlignSensors, AnExposureTooShortToSeeAnEdgeIsSaidAndWhatToDo) {
  EXPECT_THAT(said_of(kRolling, microseconds(60)), HasSubstr("lengthen"));
  // Less than two flashes: of no use, whether a sweep happens to meet it or not.
  EXPECT_THAT(said_of(kGlobal, microseconds(30)), HasSubstr("lengthen"));
}

TEST(AlignSensors, AFlashLongerThanTheExposureIsSaidAndWhatToDo) {
  EXPECT_THAT(said_of(kGlobal, milliseconds(1), milliseconds(3)), HasSubstr("shorten the flash"));
  EXPECT_THAT(said_of(kRolling, milliseconds(1), milliseconds(3)), HasSubstr("shorten the flash"));
}

TEST(AlignSensors, AWrongReadDirectionOfARollingShutterIsNoticed) {
  SmallBench bench(mixed_rig(4, {kCcd, kRolling}));
  bench.options.timing[1].direction = smear::ReadDirection::bottom_first;
  bench.options.align.max_looks = 1;
  const auto result = rig::run_align(bench.align, bench.options);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->last.verdict, smear::AlignVerdict::given_up);
  EXPECT_THAT(result->words.cameras[1], HasSubstr("other read direction"));
}

TEST(AlignSensors, FlashesThatLightNothingInViewAreSaid) {
  drivers::VirtualRigOptions setup = mixed_rig(4, {kCcd, kRolling, kGlobal});
  setup.scene.room_share = 0;
  setup.cameras[2].lamp.x = -400;  // its light alone would tell a global shutter's phase
  SmallBench bench(setup);
  bench.options.align.max_looks = 1;
  const auto result = rig::run_align(bench.align, bench.options);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->last.verdict, smear::AlignVerdict::given_up);
  EXPECT_THAT(result->words.cameras[1], HasSubstr("let the strobe light"));
  EXPECT_THAT(result->words.cameras[2], HasSubstr("bring the strobe into view"));
}

TEST(AlignSensors, ARecordingOfThemReplaysToTheBit) {
  SmallBench bench(mixed_rig(6, {kCcd, kRolling, kGlobal}));
  bench.options.align.policy = smear::AlignPolicy::timed;
  const auto rounds = expect_replays(bench);
  EXPECT_THAT(rounds, testing::Each(HasSubstr("\"sensor\":\"global\"")));
  EXPECT_THAT(rounds, testing::Contains(HasSubstr("\"reset\":true")));
}

}  // namespace
}  // namespace emberlock::cli
