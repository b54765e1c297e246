// SPDX-License-Identifier: Apache-2.0
// One alignment, stepped by a caller that does other things between its rounds.
#include "rig/align/alignment.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/align/decision_proto.h"
#include "tests/support/small_rig.h"

namespace emberlock::rig {
namespace {

using test::small_rig;
using test::SmallBench;
using ::testing::IsEmpty;

/// Four CCDs, two of whose crystals are 50 ppm apart, and their alignment.
class AlignmentTest : public testing::Test {
 protected:
  static drivers::VirtualRigOptions setup() {
    drivers::VirtualRigOptions rig = small_rig(2);
    rig.cameras[1].timing.frame_period = rig.cameras[0].timing.frame_period * (1 - 25e-6);
    rig.cameras[2].timing.frame_period = rig.cameras[0].timing.frame_period * (1 + 25e-6);
    return rig;
  }

  void SetUp() override {
    bench.options.align.policy = smear::AlignPolicy::timed;
    auto made = Alignment::create(bench.align, bench.options, observer, {}, [this] { return stop(); });
    ASSERT_TRUE(made.ok()) << made.error().message();
    alignment = std::move(made).value();
  }

  bool stop() {
    ++asked;
    return stop_after && bench.align.clock->now() >= *stop_after;
  }

  /// Rounds until all are aligned.
  void align() {
    if (alignment->last().round == 0) {
      ASSERT_TRUE(alignment->start().ok());
    }
    do {
      ASSERT_TRUE(alignment->round().ok());
      ASSERT_LT(alignment->last().round, 100) << alignment->words().reason;
    } while (alignment->last().verdict != smear::AlignVerdict::aligned);
  }

  SmallBench bench{setup()};
  AlignObserver observer = [this](const AlignRoundReport& report) { rows.push_back(report.frames); };
  std::vector<std::vector<std::vector<Frame>>> rows;  ///< frames of each round
  std::unique_ptr<Alignment> alignment;
  std::optional<TimePoint> stop_after;
  int asked = 0;
};

TEST_F(AlignmentTest, NothingIsLockedBeforeItIsAligned) {
  const TimePoint now = bench.align.clock->now();
  EXPECT_FALSE(alignment->locked(now));
  EXPECT_EQ(alignment->time_left(now), Seconds(0));
  EXPECT_EQ(alignment->next_check(now), Seconds(0));
  EXPECT_FALSE(alignment->worst_pair(now));
  EXPECT_THAT(alignment->errors(now), IsEmpty());
  EXPECT_EQ(lock_evidence(*alignment, now).cameras_size(), 0);
  EXPECT_FALSE(alignment->drift(0));
}

TEST_F(AlignmentTest, WhatItForetellsOfAnInstantIsTheTruthOfIt) {
  align();
  const SecondsPerRow row = alignment->options().row_time;
  for (int i = 0; i < 4; ++i) {
    const TimePoint now = bench.align.clock->now();
    ASSERT_TRUE(alignment->locked(now));
    EXPECT_NEAR((*alignment->worst_pair(now) / row / 2).value(), bench.true_error(row).value(), 1.5) << i;
    EXPECT_LT(alignment->next_check(now), alignment->time_left(now)) << "a check comes first";
    bench.align.clock->sleep_until(now + 0.3 * alignment->next_check(now));
  }
}

TEST_F(AlignmentTest, ARecordingIsToldTheErrorsOfItsBeginning) {
  align();
  const TimePoint now = alignment->at() + 0.9 * alignment->next_check(alignment->at());
  const v1::DecisionEvent told = lock_evidence(*alignment, now);
  ASSERT_EQ(told.cameras_size(), bench.rig->size());
  const Seconds period = alignment->options().period;
  for (int i = 0; i < told.cameras_size(); ++i) {
    const v1::DecisionEvent::Camera& camera = told.cameras(i);
    EXPECT_GT(camera.sigma_s(), 0);
    EXPECT_GE(camera.sigma_s(), lock_evidence(*alignment, alignment->at()).cameras(i).sigma_s());
    const Seconds later =
        wrap_symmetric(bench.rig->read_start_after(i, now) - bench.rig->read_start_after(0, now), period);
    const double apart = camera.error_s() - told.cameras(0).error_s();
    EXPECT_NEAR(apart, -later.value(), 4 * std::hypot(camera.sigma_s(), told.cameras(0).sigma_s())) << i;
  }
  EXPECT_EQ(told.worst_pair_s(), alignment->worst_pair(now)->value());
}

TEST_F(AlignmentTest, ChecksTellTheDriftOfEveryCamera) {
  align();
  for (int i = 0; i < 4; ++i) {
    alignment->wait(alignment->at() + alignment->next_check(alignment->at()));
    ASSERT_TRUE(alignment->round().ok());
  }
  std::vector<double> truth;
  for (int i = 0; i < bench.rig->size(); ++i)
    truth.push_back(1e6 *
                    (bench.rig->truth(0).timing.frame_period / bench.rig->truth(i).timing.frame_period));
  const auto [slowest, fastest] = std::minmax_element(truth.begin(), truth.end());
  const double middle = (*slowest + *fastest) / 2;
  for (std::size_t i = 0; i < truth.size(); ++i)
    EXPECT_NEAR(alignment->drift(i)->value(), truth[i] - middle, 3) << i;
}

TEST_F(AlignmentTest, ALockThatNobodyChecksEndsBeforeACameraLeaves) {
  align();
  const TimePoint aligned = alignment->at();
  const SecondsPerRow row = alignment->options().row_time;
  TimePoint now = bench.align.clock->now();
  while (alignment->locked(now)) {
    ASSERT_LE(bench.true_error(row), alignment->options().tolerance.in_rows(row) + Rows(0.1))
        << (now - aligned).value();
    bench.align.clock->sleep_until(now + Seconds(0.5));
    now = bench.align.clock->now();
  }
  EXPECT_LT(now - aligned, Seconds(600)) << "the crystals lead out";
  EXPECT_EQ(alignment->next_check(now), Seconds(0));
  align();
  EXPECT_TRUE(alignment->locked(bench.align.clock->now()));
  EXPECT_GT(alignment->checks(), 0);
}

TEST_F(AlignmentTest, CamerasAreResetBeforeTheyLeaveAndTheLockIsMissedForSecondsOnly) {
  align();
  const TimePoint began = bench.align.clock->now();
  const SecondsPerRow row = alignment->options().row_time;
  Seconds unlocked;
  int renewals = 0;
  while (bench.align.clock->now() - began < Seconds(1800)) {
    const TimePoint now = bench.align.clock->now();
    if (const Seconds left = alignment->next_check(now); left >= milliseconds(1)) {
      ASSERT_TRUE(alignment->locked(now + left));
      alignment->wait(now + left);
    } else {
      ASSERT_TRUE(alignment->round().ok());
      renewals += alignment->last().renews && alignment->state().renewal == 1 ? 1 : 0;
      if (!alignment->locked(bench.align.clock->now())) unlocked += bench.align.clock->now() - now;
      ASSERT_TRUE(alignment->last().renews || alignment->last().verdict == smear::AlignVerdict::aligned)
          << alignment->words().reason;
    }
    if (!alignment->locked(bench.align.clock->now())) continue;
    EXPECT_LE(bench.true_error(row), alignment->options().tolerance.in_rows(row));
  }
  EXPECT_GT(renewals, 3) << "50 ppm lead through +-30 rows of 150 us in three minutes";
  EXPECT_LT(unlocked, Seconds(1.5 * renewals + 5));
}

TEST_F(AlignmentTest, APressOfAShutterIsSeenWithinASecondWhetherAwaitedOrNot) {
  bench.options.align.reset_by = smear::ResetBy::anybody;
  align();
  bench.rig->set_reset(ShutterReset::by_hand);
  auto made = Alignment::create(bench.align, bench.options);
  ASSERT_TRUE(made.ok());
  alignment = std::move(made).value();
  align();
  for (int press = 0; press < 6; ++press) {
    const int before = alignment->resets();
    const bool awaited = alignment->last().reset_next.has_value();
    const std::size_t camera = alignment->last().reset_next.value_or(1);
    const TimePoint pressed = bench.align.clock->now();
    ASSERT_TRUE(bench.rig->camera(static_cast<int>(camera)).reset_shutter(pressed).ok());
    while (alignment->resets() == before && alignment->last().jumped.empty()) {
      const TimePoint now = bench.align.clock->now();
      ASSERT_LT(now - pressed, Seconds(5));
      if (const Seconds left = alignment->next_check(now); left >= milliseconds(1)) {
        alignment->wait(now + left);
      } else {
        ASSERT_TRUE(alignment->round().ok());
      }
    }
    EXPECT_LE(bench.align.clock->now() - pressed, Seconds(1)) << press << (awaited ? " awaited" : "");
    EXPECT_FALSE(alignment->locked(bench.align.clock->now()));
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(alignment->round().ok());  // until it is asked for again
  }
}

TEST_F(AlignmentTest, AFlameIsFilmedInTheDarkBetweenTwoChecks) {
  align();
  const int before = alignment->last().round;
  ASSERT_TRUE(alignment->darken().ok());
  const TimePoint dark = bench.align.clock->now() + 2 * alignment->options().period;
  TimePoint last = dark;
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < bench.rig->size(); ++k) {
      const Frame frame = bench.rig->camera(k).next_frame(Seconds(1)).value();
      const drivers::VirtualLamp& lamp = bench.rig->truth(k).lamp;
      last = std::max(last, frame.stamp.monotonic_time);
      if (frame.stamp.monotonic_time < dark) continue;
      EXPECT_LT(frame.image->view().sample(static_cast<int>(lamp.x), static_cast<int>(lamp.y.value())), 100)
          << "no flash lights the lamp";
    }
  }
  alignment->pass_over(last);
  rows.clear();
  ASSERT_TRUE(alignment->round().ok());
  ASSERT_EQ(rows.size(), 1U);
  for (const auto& camera : rows.front()) {
    for (const Frame& frame : camera) EXPECT_GT(frame.stamp.monotonic_time, last);
  }
  EXPECT_EQ(alignment->last().round, before + 1) << "the row time isn't measured again";
  EXPECT_EQ(alignment->last().verdict, smear::AlignVerdict::aligned) << alignment->words().reason;
}

TEST_F(AlignmentTest, AStopEndsCalibrationRoundAndWaitSoonAndTheyCanBeMadeAgain) {
  const auto stops_soon = [&](const auto& act) {
    stop_after = bench.align.clock->now() + milliseconds(120);
    act();
    EXPECT_TRUE(alignment->stopped());
    EXPECT_LT(bench.align.clock->now() - *stop_after, milliseconds(500));
    stop_after.reset();
  };
  stops_soon([&] { EXPECT_TRUE(alignment->start().ok()); });
  EXPECT_FALSE(alignment->row_clocks()[0]);
  ASSERT_TRUE(alignment->start().ok());
  EXPECT_TRUE(alignment->row_clocks()[0]);
  stops_soon([&] { EXPECT_TRUE(alignment->round().ok()); });
  EXPECT_EQ(alignment->last().round, 0) << "nothing was decided";
  align();
  stops_soon([&] { alignment->wait(bench.align.clock->now() + Seconds(500)); });
}

TEST_F(AlignmentTest, WhatIsDrawnIntoAPictureStandsWhereTheModelPutsIt) {
  align();
  const auto& frames = rows.back();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const int camera = static_cast<int>(i);
    const auto truth = bench.rig->dots(camera, frames[i].back().stamp.frame_id);
    const CameraSight& sight = alignment->sights()[i];
    ASSERT_TRUE(sight.lamp && sight.target_row && sight.tolerance) << i;
    EXPECT_NEAR(sight.lamp->x, bench.rig->truth(camera).lamp.x, 0.3);
    EXPECT_NEAR(sight.lamp->y.value(), bench.rig->truth(camera).lamp.y.value(), 0.3);
    ASSERT_EQ(truth.size(), 1U);
    ASSERT_EQ(sight.dots.size(), 1U);
    EXPECT_NEAR(sight.dots[0].y.value(), truth[0].y.value(), 0.5);
    // A camera that reads earlier sees its dot further down the read: by so many rows, in its direction.
    const smear::CcdTiming& timing = alignment->timing()[i];
    const Rows error = *alignment->last().cameras[i].error / timing.row_time;
    const Rows expected = truth[0].y - static_cast<double>(timing.direction) * error;
    EXPECT_NEAR(sight.target_row->value(), expected.value(), 1.0) << i;
    EXPECT_NEAR(sight.tolerance->value(), 30, 1);
  }
}

TEST(CameraSight, ATargetWhereADotWouldNotShowIsAbsent) {
  const smear::CcdTiming timing{.rows = 240, .shifts = 260, .row_time = microseconds_per_row(150)};
  smear::SmearReading reading;
  reading.lamp = smear::LampReading{.x = 10, .y = Rows(100)};
  const auto target = [&](double rows) {
    return sight_of(reading, SensorKind::ccd, timing, Rows(rows) * timing.row_time, milliseconds(3))
        .target_row;
  };
  ASSERT_TRUE(target(20.75));
  EXPECT_NEAR(target(20.75)->value(), 120.25, 1e-9);
  EXPECT_FALSE(target(150)) << "among the dummy lines";
  ASSERT_TRUE(target(180.5));
  EXPECT_NEAR(target(180.5)->value(), 20, 1e-9) << "wrapped";
  EXPECT_FALSE(target(261)) << "the register rests";
  EXPECT_FALSE(
      sight_of(reading, SensorKind::rolling_shutter, timing, Seconds(0.01), milliseconds(3)).target_row);
}

TEST(CameraSight, TheBandHoldsJustTheDotsThatAreInToleranceWhereverTheyWrap) {
  smear::SmearReading reading;
  reading.lamp = smear::LampReading{.x = 10, .y = Rows(100)};
  for (const smear::ReadDirection direction :
       {smear::ReadDirection::top_first, smear::ReadDirection::bottom_first}) {
    const smear::CcdTiming timing{.rows = 240,
                                  .shifts = 260,
                                  .frame_period = Rows(271) * microseconds_per_row(150),
                                  .row_time = microseconds_per_row(150),
                                  .direction = direction};
    const Rows tolerance(30);
    for (int target = 0; target < 271; target += 7) {
      const CameraSight sight = sight_of(reading, SensorKind::ccd, timing, Rows(target) * timing.row_time,
                                         tolerance * timing.row_time);
      for (int k = 0; k < timing.shifts; ++k) {
        const auto dot = smear::smear_centre(timing, reading.lamp->y, {0, k, 1});
        if (!dot) continue;
        const bool in_tolerance = abs(wrap_symmetric(Rows(k + 0.5 - target), Rows(271))) <= tolerance;
        const bool in_band = std::any_of(sight.band.begin(), sight.band.end(), [&](const RowSpan& span) {
          return span.first <= dot->row && dot->row <= span.last;
        });
        EXPECT_EQ(in_band, in_tolerance) << "target " << target << ", dot at " << dot->row.value();
      }
      EXPECT_LE(sight.band.size(), 3U);
    }
  }
}

}  // namespace
}  // namespace emberlock::rig
