// SPDX-License-Identifier: Apache-2.0
// Cameras held in tolerance for minutes of their own time, on a virtual clock.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/align/run.h"
#include "session/reader.h"
#include "tests/support/aligned.h"
#include "tests/support/temp_folder.h"

namespace emberlock::cli {
namespace {

using test::expect_replays;
using test::small_rig;
using test::SmallBench;
using testing::HasSubstr;

/// Two crystals that are 50 ppm apart, which takes their cameras out of +-30 rows of 150 us in three minutes.
SmallBench drifting_bench() {
  drivers::VirtualRigOptions setup = small_rig(2);
  setup.cameras[1].timing.frame_period = setup.cameras[0].timing.frame_period * (1 - 25e-6);
  setup.cameras[2].timing.frame_period = setup.cameras[0].timing.frame_period * (1 + 25e-6);
  SmallBench bench(setup);
  bench.options.align.policy = smear::AlignPolicy::timed;
  bench.options.hold = Seconds(600);
  return bench;
}

TEST(AlignHold, ChecksAsAnnouncedResetWhatLeavesAndEndsInTolerance) {
  SmallBench bench = drifting_bench();
  TimePoint aligned{};
  TimePoint last{};
  int checks = 0;
  int resets = 0;  // ordered after the cameras were first aligned
  Seconds late;
  std::optional<TimePoint> due;
  const auto result = rig::run_align(bench.align, bench.options, [&](const rig::AlignRoundReport& r) {
    if (due) {
      ++checks;
      late = std::max(late, r.round.at - *due);
    }
    due.reset();
    last = r.round.at;
    if (r.decision.verdict == smear::AlignVerdict::aligned) {
      if (aligned == TimePoint{}) aligned = r.round.at;
      ASSERT_TRUE(r.decision.next_check);
      // A check takes a round: none can come sooner.
      due = r.round.at + std::max(*r.decision.next_check, r.options.round_time);
      const Rows within = r.options.tolerance.in_rows(r.options.row_time) + Rows(1);
      EXPECT_LT(bench.true_error(r.options.row_time), within) << r.decision.round;
    } else if (aligned != TimePoint{}) {
      for (const smear::CameraDecision& camera : r.decision.cameras) resets += camera.reset ? 1 : 0;
    }
  });
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(result->last.verdict, smear::AlignVerdict::aligned);
  EXPECT_GE(last - aligned, Seconds(600));
  EXPECT_LT(last - aligned, Seconds(610));
  EXPECT_EQ(result->checks, checks);
  EXPECT_GT(checks, 5);
  EXPECT_LT(checks, 200) << "waits between them";
  EXPECT_GT(resets, 0) << "something drifted out";
  EXPECT_LE(late, Seconds(0)) << "no check comes after the time for which tolerance was promised";
}

TEST(AlignHold, FramesThatComeWhileNothingIsFilmedAreCountedAsPassedOver) {
  drivers::VirtualRigOptions setup = small_rig(2);
  for (drivers::VirtualCameraOptions& camera : setup.cameras)  // in step: nobody is reset
    camera.first_phase = 0.6 * camera.timing.frame_period;
  SmallBench bench(setup);
  bench.options.hold = Seconds(120);
  const test::TempFolder folder;
  const auto result = rig::record_align(folder / "session", bench.align, bench.options);
  ASSERT_TRUE(result.ok()) << result.error().message();
  ASSERT_GT(result->checks, 0);
  ASSERT_EQ(result->resets, 0);
  const auto session = session::SessionReader::open(folder / "session");
  ASSERT_TRUE(session.ok());
  for (const v1::CameraStream& camera : session->manifest().cameras()) {
    EXPECT_GT(camera.counts().passed_over(), 1000U);
    EXPECT_EQ(camera.counts().camera_gap(), 0U);
  }
}

TEST(AlignHold, EndsSoonWhenAskedTo) {
  SmallBench bench = drifting_bench();
  bench.options.hold = rig::kUntilStopped;
  int asked = 0;
  const auto result = rig::run_align(bench.align, bench.options, {}, {}, [&] { return ++asked > 2000; });
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_GT(result->checks, 0);
  EXPECT_LE(asked, 2005);
}

TEST(AlignHold, TheLimitOfRoundsCountsFromTheLastTimeAllWereIn) {
  SmallBench bench = drifting_bench();
  bench.options.align.max_rounds = 12;
  const auto result = rig::run_align(bench.align, bench.options);
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->last.verdict, smear::AlignVerdict::aligned) << result->words.reason;
  EXPECT_GT(result->last.round, 12);
}

TEST(AlignHold, ARecordingReplaysToTheBitThoughItWasStopped) {
  SmallBench bench = drifting_bench();
  int asked = 0;
  const auto rounds = expect_replays(bench, [&] { return ++asked > 1000; });
  EXPECT_GT(rounds.size(), 4U);
  EXPECT_THAT(rounds.back(), HasSubstr("\"aligned\":true"));
}

}  // namespace
}  // namespace emberlock::cli
