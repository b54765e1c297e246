// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/align/run.h"
#include "rig/align/stagger.h"
#include "tests/support/aligned.h"

namespace emberlock::cli {
namespace {

using test::expect_aligned_in_truth;
using test::kReadingError;
using test::small_rig;
using test::SmallBench;
using testing::HasSubstr;

class EveryPolicy : public testing::TestWithParam<smear::AlignPolicy> {};

TEST_P(EveryPolicy, BringsVirtualCamerasWithinToleranceInTruth) {
  SmallBench bench(small_rig(7));
  bench.options.align.policy = GetParam();
  expect_aligned_in_truth(bench);
}

TEST_P(EveryPolicy, BringsStaggeredVirtualCamerasEachToItsOwnInstantInTruth) {
  SmallBench bench(small_rig(7, 5));
  bench.options.align.policy = GetParam();
  bench.options.align.tolerance.amount = Rows(25);
  bench.options.offsets = rig::stagger(bench.align.cameras).value();
  expect_aligned_in_truth(bench);
}

INSTANTIATE_TEST_SUITE_P(AlignRun, EveryPolicy,
                         testing::Values(smear::AlignPolicy::fixed_reference, smear::AlignPolicy::densest,
                                         smear::AlignPolicy::timed));

drivers::VirtualRigOptions trimmable_rig(std::uint64_t seed) {
  drivers::VirtualRigOptions setup = small_rig(seed);
  for (drivers::VirtualCameraOptions& camera : setup.cameras)
    camera.trim = FrameRateTrim{PartsPerMillion(200), PartsPerMillion(0.5), milliseconds(80)};
  return setup;
}

TEST(AlignRun, TrimsBringVirtualCamerasWithinARowInTruth) {
  SmallBench bench(trimmable_rig(7));
  bench.options.align.policy = smear::AlignPolicy::trimmed;
  bench.options.align.tolerance.amount = Rows(1);
  bench.options.align.trim_time = Seconds(15);
  bench.options.frames_per_round = 8;
  const auto result = rig::run_align(bench.align, bench.options);
  ASSERT_TRUE(result.ok()) << result.error().message();
  ASSERT_EQ(result->last.verdict, smear::AlignVerdict::aligned) << result->words.reason;
  EXPECT_LT(bench.true_error(result->options.row_time), Rows(1) + kReadingError);
  ASSERT_TRUE(result->last.next_check);
}

TEST(AlignRun, TrimsStaggerVirtualCamerasWithinARowInTruth) {
  SmallBench bench(trimmable_rig(7));
  bench.options.align.policy = smear::AlignPolicy::trimmed;
  bench.options.align.tolerance.amount = Rows(1);
  bench.options.align.trim_time = Seconds(15);
  bench.options.frames_per_round = 8;
  bench.options.offsets = rig::stagger(bench.align.cameras).value();
  const auto result = rig::run_align(bench.align, bench.options);
  ASSERT_TRUE(result.ok()) << result.error().message();
  ASSERT_EQ(result->last.verdict, smear::AlignVerdict::aligned) << result->words.reason;
  EXPECT_LT(bench.true_error(result->options.row_time), Rows(1) + kReadingError);
}

TEST(AlignRun, StaggeringNeedsSeveralCamerasOfOneRateAndInstantsTheToleranceTellsApart) {
  SmallBench alone(small_rig(7, 1));
  EXPECT_THAT(rig::stagger(alone.align.cameras).error().message(), HasSubstr("one camera"));
  drivers::VirtualRigOptions setup = small_rig(7);
  SmallBench bench(setup);
  bench.options.offsets = rig::stagger(bench.align.cameras).value();
  bench.options.align.tolerance.amount = milliseconds(6);
  EXPECT_THAT(rig::run_align(bench.align, bench.options).error().message(), HasSubstr("mixes them up"));
  bench.options.offsets.pop_back();
  EXPECT_THAT(rig::run_align(bench.align, bench.options).error().message(), HasSubstr("go by camera"));
  setup.cameras[2].nominal_rate = Hertz(1.001 * setup.cameras[2].nominal_rate.value());
  SmallBench unequal(setup);
  EXPECT_THAT(rig::stagger(unequal.align.cameras).error().message(), HasSubstr("one frame rate"));
}

TEST(AlignRun, WhatTheLimitsDontAllowIsRefusedBeforeAnythingIsReset) {
  SmallBench bench(small_rig(7));
  bench.options.align.policy = smear::AlignPolicy::densest;
  bench.options.align.tolerance.amount = Rows(2);
  bench.options.align.limits = smear::AlignLimits{5, Seconds(600), 0.9};
  const auto result = rig::run_align(bench.align, bench.options);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(result->last.verdict, smear::AlignVerdict::refused);
  EXPECT_EQ(result->resets, 0);
  EXPECT_THAT(result->words.reason, HasSubstr("What could be met"));
}

// One second of a comb at the size of the paper's videos.
TEST(AlignRun, MeasuresTheRowTimeWithin5ns) {
  const drivers::VirtualRigOptions setup = drivers::draw_virtual_rig({.cameras = 2, .seed = 3});
  SmallBench bench(setup);
  bench.options.comb_frames = 24;
  bench.options.align.max_rounds = 1;
  const auto result = rig::run_align(bench.align, bench.options);
  ASSERT_TRUE(result.ok()) << result.error().message();
  for (int i = 0; i < bench.rig->size(); ++i) {
    const auto& clock = result->row_clocks[static_cast<std::size_t>(i)];
    ASSERT_TRUE(clock) << i;
    EXPECT_NEAR(clock->row_time.value(), bench.rig->truth(i).timing.row_time.value(), 5e-9) << i;
  }
}

TEST(AlignRun, BothReadDirectionsAndSeveralShiftCounts) {
  drivers::VirtualRigDraw draw{.cameras = 4, .seed = 11, .models = drivers::VirtualRigDraw::Models::mixed};
  draw.layout.size = {320, 240};
  draw.row_time = microseconds_per_row(150);
  const drivers::VirtualRigOptions setup = drivers::draw_virtual_rig(draw);
  SmallBench bench(setup);
  bench.options.align.policy = smear::AlignPolicy::timed;
  expect_aligned_in_truth(bench);
}

// The strobe's steps don't hold the frame rate, and its time base is off too: some 250 ppm of common motion.
TEST(AlignRun, UnderABeat) {
  drivers::VirtualRigOptions setup = small_rig(5);
  setup.strobe.rate_step = Hertz(0.01);
  setup.strobe.rate_error = PartsPerMillion(80);
  SmallBench bench(setup);
  bench.options.align.policy = smear::AlignPolicy::timed;
  bench.options.align.tolerance.amount = Rows(10);
  bench.options.rate_error = PartsPerMillion(100);
  expect_aligned_in_truth(bench);
}

TEST(AlignRun, TheNextRunKnowsTheDelaysThatThisOneLearnt) {
  SmallBench bench(small_rig(2));
  bench.options.align.policy = smear::AlignPolicy::timed;
  const auto first = rig::run_align(bench.align, bench.options);
  ASSERT_TRUE(first.ok());
  bench.options.delays = first->delays;
  for (drivers::Camera* camera : bench.align.cameras) camera->stop();  // phases are drawn anew by start()
  bench.options.align.tolerance.amount = Rows(10);
  const auto second = rig::run_align(bench.align, bench.options);
  ASSERT_TRUE(second.ok());
  EXPECT_EQ(second->last.verdict, smear::AlignVerdict::aligned);
  // Three of four cameras have been taught; the one that stayed may need a reset to be taught and one to
  // land.
  EXPECT_LE(second->resets, 5);
}

TEST(AlignRun, ALampOutOfViewIsNamedNotAligned) {
  drivers::VirtualRigOptions setup = small_rig(1);
  setup.cameras[2].lamp.x = -400;
  SmallBench bench(setup);
  bench.options.measure_row_time = false;
  bench.options.align.row_time = microseconds_per_row(150);
  const auto result = rig::run_align(bench.align, bench.options);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(result->last.verdict, smear::AlignVerdict::given_up);
  EXPECT_THAT(result->words.reason, HasSubstr("virtual-02"));
  EXPECT_EQ(result->resets, 0);
}

/// Stray light on one camera: a disk as bright as a dot, which no flash moves.
class Glint final : public drivers::LightField {
 public:
  Glint(int camera, const drivers::VirtualCameraOptions& at, Rows y) : camera_(camera), at_(at), y_(y) {}
  void add_radiance(int camera, TimePoint, Seconds, std::span<float> rgb) const override {
    if (camera != camera_) return;
    const ImageSize size = at_.layout.size;
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const double rho = std::hypot(x - at_.lamp.x, y - y_.value());
        const double level = 40 * 0.5 * std::erfc((rho - at_.lamp.radius) / 1.1);
        const auto sample = 3 * (static_cast<std::size_t>(size.width) * y + x);
        for (std::size_t c = 0; c < 3; ++c) rgb[sample + c] += static_cast<float>(level);
      }
    }
  }

 private:
  int camera_;
  drivers::VirtualCameraOptions at_;
  Rows y_;
};

/// Three cameras within a few rows of each other, and one whose flash falls into the rest of its transfer:
/// what stands where its dot would be, were it in step, is a reflection.
SmallBench bench_with_a_reflection() {
  drivers::VirtualRigOptions setup = small_rig(3);
  const Seconds period = setup.cameras[0].timing.frame_period;
  for (drivers::VirtualCameraOptions& camera : setup.cameras) camera.first_phase = 0.6 * period;
  drivers::VirtualCameraOptions& last = setup.cameras[3];
  last.first_phase = 0.6 * period + Rows(125) * last.timing.row_time;
  const Rows in_step(110);
  const bool below = last.lamp.y + in_step < Rows(last.timing.rows);
  setup.scene.passes.push_back(drivers::Pass::flame);
  setup.scene.flame = std::make_shared<Glint>(
      3, last, below ? last.lamp.y + in_step : last.lamp.y + in_step - Rows(last.timing.shifts));
  SmallBench bench(setup);
  bench.options.measure_row_time = false;
  bench.options.align.row_time = last.timing.row_time;
  for (smear::CcdTiming& timing : bench.options.timing) timing.row_time = last.timing.row_time;
  return bench;
}

TEST(AlignRun, AReflectionThatLooksLikeADotIsFoundByMovingTheStrobe) {
  SmallBench believing = bench_with_a_reflection();
  believing.options.align.strobe_step = Seconds(0);
  const auto taken_in = rig::run_align(believing.align, believing.options);
  ASSERT_TRUE(taken_in.ok()) << taken_in.error().message();
  ASSERT_EQ(taken_in->last.verdict, smear::AlignVerdict::aligned) << taken_in->words.reason;
  ASSERT_GT(believing.true_error(taken_in->options.row_time), Rows(50)) << "a dot that is believed misleads";

  SmallBench bench = bench_with_a_reflection();
  std::vector<std::string> said;
  const auto result = rig::run_align(bench.align, bench.options, [&](const rig::AlignRoundReport& report) {
    said.push_back(report.words.cameras[3]);
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_THAT(report.words.cameras[i], testing::Not(HasSubstr("reflection"))) << i;
  });
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(result->last.verdict, smear::AlignVerdict::given_up);
  EXPECT_THAT(result->words.reason, HasSubstr("virtual-03"));
  EXPECT_EQ(result->resets, 0);
  ASSERT_GE(said.size(), 2U);
  EXPECT_THAT(said[1], HasSubstr("stood still when the strobe's flashes were moved by 2.00 ms"));
  EXPECT_THAT(said[1], HasSubstr("look for a reflection"));
}

TEST(AlignRun, AStepOfTheStrobeThatGoesHalfRoundIsRefused) {
  SmallBench bench(small_rig(1));
  const Seconds period = bench.rig->truth(0).timing.frame_period;
  for (const Seconds step : {period / 3, milliseconds(-1), Seconds(NAN)}) {
    bench.options.align.strobe_step = step;
    const auto result = rig::run_align(bench.align, bench.options);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(result.error().message(), HasSubstr("less than a quarter of the frame period, 10.4"));
  }
}

TEST(AlignRun, CamerasOfDifferentFrameRatesAreRefused) {
  drivers::VirtualRigOptions setup = small_rig(1);
  setup.cameras[1].nominal_rate = Hertz(25);
  SmallBench bench(setup);
  const auto result = rig::run_align(bench.align, bench.options);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(result.error().message(), HasSubstr("virtual-01"));
}

}  // namespace
}  // namespace emberlock::cli
