// SPDX-License-Identifier: Apache-2.0
// Cameras aligned by a strobe that somebody sets by its dial.
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/commands.h"
#include "rig/align/json.h"
#include "tests/support/aligned.h"
#include "tests/support/dial_bench.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

using test::DialBench;
using test::kReadingError;
using test::small_rig;
using testing::HasSubstr;

constexpr double kFrameRate = 23.976;

struct OffBy {
  double ppm;
  smear::AlignPolicy policy;
  std::uint64_t seed;
};

class DialIsOffSlow : public testing::TestWithParam<OffBy> {};

TEST_P(DialIsOffSlow, FromColdToLockedInTruth) {
  DialBench bench(small_rig(GetParam().seed), PartsPerMillion(GetParam().ppm));
  bench.options.align.policy = GetParam().policy;
  bool measured_right = true;
  const auto result = bench.run([&](const rig::AlignRoundReport& report) {
    const auto& dial = report.decision.dial;
    ASSERT_TRUE(dial);
    if (!dial->measured || bench.rig->dial()->shown() == Hertz(0)) return;
    const double off = *dial->measured / bench.rig->dial()->truth() - 1;
    measured_right = measured_right && std::abs(off) < 1e-3;
    EXPECT_LT(std::abs(off), 1e-3) << report.decision.round;
  });
  ASSERT_TRUE(result.ok()) << result.error().message();
  ASSERT_EQ(result->last.verdict, smear::AlignVerdict::aligned) << result->words.reason;
  EXPECT_TRUE(measured_right);
  const SecondsPerRow row = result->options.row_time;
  EXPECT_LT(bench.true_error(row), result->options.tolerance.in_rows(row) + kReadingError);
  for (std::size_t i = 0; i < result->cameras.size(); ++i) {
    const auto& error = result->last.cameras[i].error;
    ASSERT_TRUE(error);
    // What is claimed of two cameras is what they truly differ by.
    const Seconds apart = *error - *result->last.cameras[0].error;
    const TimePoint now = bench.rig->clock().now();
    const Seconds truth =
        bench.rig->read_start_after(0, now) - bench.rig->read_start_after(static_cast<int>(i), now);
    const Seconds off = wrap_symmetric(apart - truth, bench.rig->truth(0).timing.frame_period);
    EXPECT_LT(std::abs((off / row).value()), 1.5) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(
    AlignDial, DialIsOffSlow,
    testing::Values(OffBy{0, smear::AlignPolicy::densest, 7}, OffBy{50, smear::AlignPolicy::densest, 7},
                    OffBy{-300, smear::AlignPolicy::timed, 3}, OffBy{3000, smear::AlignPolicy::timed, 5},
                    OffBy{-3000, smear::AlignPolicy::densest, 2}, OffBy{0, smear::AlignPolicy::timed, 4}));

struct SetWrong {
  double per_minute;
  const char* way;
};

class DialIsSetWrongSlow : public testing::TestWithParam<SetWrong> {};

TEST_P(DialIsSetWrongSlow, IsToldWhichWayAndGoesOnOnceItIsTurned) {
  DialBench bench(small_rig(7));
  bench.options.align.policy = smear::AlignPolicy::timed;
  const Hertz wrong(GetParam().per_minute / 60);
  bench.rig->dial()->turn(wrong);
  int told = 0;
  const auto result = bench.run([&](const rig::AlignRoundReport& report) {
    const auto& dial = report.decision.dial;
    ASSERT_TRUE(dial);
    if (bench.rig->dial()->shown() != wrong) return;
    ++told;
    EXPECT_TRUE(dial->act);
    ASSERT_TRUE(dial->measured) << report.words.dial;
    EXPECT_NEAR(*dial->measured / wrong, 1, 1e-3) << report.words.dial;
    EXPECT_NEAR(dial->set.value(), kFrameRate, 1e-3);
    EXPECT_THAT(report.words.dial, HasSubstr(GetParam().way));
    EXPECT_THAT(report.words.dial, HasSubstr("to 1438.6 flashes a minute (23.977 Hz)"));
    EXPECT_EQ(report.decision.verdict, smear::AlignVerdict::go_on);
    for (const smear::CameraDecision& camera : report.decision.cameras) EXPECT_FALSE(camera.reset);
  });
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(told, 1);
  ASSERT_EQ(result->last.verdict, smear::AlignVerdict::aligned) << result->words.reason;
  const SecondsPerRow row = result->options.row_time;
  EXPECT_LT(bench.true_error(row), result->options.tolerance.in_rows(row) + kReadingError);
}

INSTANTIATE_TEST_SUITE_P(AlignDial, DialIsSetWrongSlow,
                         testing::Values(SetWrong{1510.5, "turn it down by"},
                                         SetWrong{1366.7, "turn it up by"}, SetWrong{719.3, "turn it up by"},
                                         SetWrong{2877.2, "turn it down by"},
                                         SetWrong{959.0, "turn it up by"},
                                         SetWrong{18000, "turn it down by"}));

TEST(AlignDialSlow, ADialThatIsOffByFivePerCentIsTurnedByWhatItIsOff) {
  DialBench bench(small_rig(4), PartsPerMillion(50000));
  bench.options.align.policy = smear::AlignPolicy::timed;
  const auto result = bench.run();
  ASSERT_TRUE(result.ok()) << result.error().message();
  ASSERT_EQ(result->last.verdict, smear::AlignVerdict::aligned) << result->words.reason;
  EXPECT_NEAR(60 * bench.rig->dial()->shown().value(), 1438.6 / 1.05, 5);
}

TEST(AlignDialSlow, ADarkOrFarTooSlowOrSteadyStrobeIsToldSo) {
  for (const double per_minute : {0.0, 200.0}) {
    DialBench bench(small_rig(4));
    if (per_minute > 0) bench.rig->dial()->turn(Hertz(per_minute / 60));
    std::string words;
    int rounds = 0;
    const auto result = rig::run_align(
        bench.align, bench.options,
        [&](const rig::AlignRoundReport& report) {
          EXPECT_EQ(report.decision.verdict, smear::AlignVerdict::go_on);
          EXPECT_TRUE(report.decision.dial->act);
          EXPECT_FALSE(report.decision.dial->measured);
          words = report.words.reason;
          ++rounds;
        },
        {}, [&] { return rounds >= 3; });
    ASSERT_TRUE(result.ok()) << result.error().message();
    EXPECT_THAT(words, HasSubstr("1438.6 flashes a minute (23.977 Hz)"));
    EXPECT_THAT(words,
                HasSubstr(per_minute > 0 ? "turn it up"
                                         : "no flash is seen, all through the round: switch the strobe on"));
  }
}

TEST(AlignDialSlow, IsTurnedInMidRunAndGoesOn) {
  drivers::VirtualRigOptions setup = small_rig(2);
  setup.cameras[1].timing.frame_period = setup.cameras[0].timing.frame_period * (1 - 25e-6);
  setup.cameras[2].timing.frame_period = setup.cameras[0].timing.frame_period * (1 + 25e-6);
  DialBench bench(setup, PartsPerMillion(200));
  bench.options.align.policy = smear::AlignPolicy::timed;
  bench.options.hold = Seconds(300);
  bool disturbed = false;
  int aligned_after = 0;
  int lost = 0;
  const auto result = bench.run([&](const rig::AlignRoundReport& report) {
    if (!disturbed && report.decision.verdict == smear::AlignVerdict::aligned) {
      disturbed = true;
      bench.rig->dial()->turn(Hertz(1500.0 / 60));
      return;
    }
    if (!disturbed) return;
    lost += report.decision.dial->act ? 1 : 0;
    aligned_after += report.decision.verdict == smear::AlignVerdict::aligned ? 1 : 0;
  });
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_GE(lost, 1);
  EXPECT_GE(aligned_after, 1);
  EXPECT_EQ(result->last.verdict, smear::AlignVerdict::aligned) << result->words.reason;
}

TEST(AlignDialSlow, ARecordingReplaysToTheSameBits) {
  DialBench bench(small_rig(7), PartsPerMillion(2000));
  bench.options.align.policy = smear::AlignPolicy::timed;
  bench.rig->dial()->turn(Hertz(1438.6 / 60));
  const auto lines = test::expect_replays(bench);
  ASSERT_FALSE(lines.empty());
  EXPECT_THAT(lines.back(), HasSubstr("\"dial\""));
  EXPECT_THAT(lines.back(), HasSubstr("\"aligned\":true"));
}

void set_the_other_way(DialBench& bench, std::size_t camera) {
  smear::ReadDirection& direction = bench.options.timing[camera].direction;
  direction = direction == smear::ReadDirection::top_first ? smear::ReadDirection::bottom_first
                                                           : smear::ReadDirection::top_first;
}

struct TurnedCamera {
  std::uint64_t seed;
  double ppm;
  std::size_t camera;
};

class DirectionIsSetWrongSlow : public testing::TestWithParam<TurnedCamera> {};

TEST_P(DirectionIsSetWrongSlow, TheCameraIsNamedByTheWalk) {
  const auto [seed, ppm, camera] = GetParam();
  DialBench bench(small_rig(seed), PartsPerMillion(ppm));
  bench.options.align.policy = smear::AlignPolicy::timed;
  set_the_other_way(bench, camera);
  const auto result = bench.run();
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(result->last.verdict, smear::AlignVerdict::given_up);
  EXPECT_THAT(result->words.reason, HasSubstr("no phase of virtual-0" + std::to_string(camera) + " after"));
  EXPECT_THAT(result->words.reason, HasSubstr("set its read direction the other way round"));
}

INSTANTIATE_TEST_SUITE_P(AlignDial, DirectionIsSetWrongSlow,
                         testing::Values(TurnedCamera{7, 1000, 2}, TurnedCamera{1, -1000, 1}));

TEST(AlignDialSlow, OfTwoCamerasThatWalkApartNobodyCanSayWhichIsRight) {
  for (const double ppm : {200.0, 2000.0}) {
    DialBench bench(small_rig(7, 2), PartsPerMillion(ppm));
    bench.options.align.policy = smear::AlignPolicy::timed;
    set_the_other_way(bench, 1);
    const auto result = bench.run();
    ASSERT_TRUE(result.ok()) << result.error().message();
    EXPECT_EQ(result->last.verdict, smear::AlignVerdict::given_up);
    EXPECT_THAT(result->words.reason, HasSubstr("no phase of virtual-00, virtual-01 after"));
    EXPECT_THAT(result->words.reason, HasSubstr("whether the read direction of each is set right"));
  }
}

TEST(AlignDial, AGlobalShutterIsRefusedBeforeAnythingIsFilmed) {
  DialBench bench(small_rig(1, 2, {SensorKind::ccd, SensorKind::global_shutter}));
  const auto result = bench.run();
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(result.error().message(), HasSubstr("virtual-01"));
  EXPECT_THAT(result.error().message(), HasSubstr("se a strobe that can be told"));
}

TEST(AlignDialSlow, TheVerbSaysWhatToSetAndGoesOnOnceItIsSet) {
  const auto run = test::run_verb(
      add_align, {"align", "--rig", "virtual:3", "--strobe", "virtual-dial:error=300,at=1510.5", "--policy",
                  "timed", "--tolerance", "100rows"});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out,
              HasSubstr("no flash is seen, all through the round: switch the strobe on, and set it to "
                        "1438.6 flashes a minute (23.977 Hz)"));
  EXPECT_THAT(run.out,
              HasSubstr("the strobe flashes at 1511.0 a minute: turn it down by 72.4 (4.79 %), to 1438.6"));
  EXPECT_THAT(run.out, HasSubstr("leave it"));
  EXPECT_THAT(run.out, HasSubstr("aligned after"));
}

TEST(AlignDial, TheVerbRefusesStrobesThatAreNone) {
  for (const char* strobe : {"dial", "manual:step=0", "manual:step", "manual:error=5", "virtual-dial:at=3",
                             "virtual-dial:error=x", "manual:step=1x"}) {
    const auto run = test::run_verb(add_align, {"align", "--rig", "virtual:2", "--strobe", strobe});
    EXPECT_EQ(run.exit_code, 2) << strobe;
    EXPECT_THAT(run.err, HasSubstr(strobe));
  }
}

}  // namespace
}  // namespace emberlock::cli
