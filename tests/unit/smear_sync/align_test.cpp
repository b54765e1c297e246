// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align.h"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "smear_sync/align/align_simulation.h"

namespace emberlock::smear {
namespace {

using testing::HasSubstr;

const SecondsPerRow kRow = microseconds_per_row(54);

/// A round in which the cameras stand at these rows; NaN is a camera that shows no dot.
AlignRound round_at(const std::vector<double>& rows) {
  AlignRound round;
  for (const double r : rows) {
    CameraView view;
    view.phase = std::isnan(r) ? Phase{PhaseState::blind, {}, {}, "clean column"}
                               : Phase{PhaseState::known, Rows(r) * kRow, Rows(0.3) * kRow, {}};
    view.stamp = TimePoint{};
    round.cameras.push_back(view);
  }
  return round;
}

std::vector<AlignCamera> rig(std::size_t n, ShutterReset method = ShutterReset::on_command) {
  std::vector<AlignCamera> cameras;
  for (std::size_t i = 0; i < n; ++i) cameras.push_back({"cam" + std::to_string(i), "ccd", method, {}});
  return cameras;
}

std::vector<int> reset_in(const AlignDecision& decision) {
  std::vector<int> cameras;
  for (std::size_t i = 0; i < decision.cameras.size(); ++i) {
    if (decision.cameras[i].reset) cameras.push_back(static_cast<int>(i));
  }
  return cameras;
}

/// The sentence to camera `i` of a first round.
std::string said_to(std::size_t i, const AlignRound& round, const std::vector<AlignCamera>& cameras,
                    const AlignOptions& options) {
  return words(align_step({}, round, cameras, options).decision, round, cameras, options).cameras[i];
}

/// What looks like a dot is believed at first sight.
AlignOptions believing(AlignPolicy policy = AlignPolicy::densest) {
  return {.policy = policy, .strobe_step = Seconds(0)};
}

const double kBlind = std::numeric_limits<double>::quiet_NaN();

TEST(Align, WithinToleranceNobodyIsReset) {
  const auto step =
      align_step({}, round_at({300, 350, 395}), rig(3), believing(AlignPolicy::fixed_reference));
  EXPECT_EQ(step.decision.verdict, AlignVerdict::aligned);
  EXPECT_THAT(reset_in(step.decision), testing::IsEmpty());
  EXPECT_NEAR((*step.decision.worst_pair / kRow).value(), 95, 1e-6);
  EXPECT_NEAR((*step.decision.cameras[2].error / kRow).value(), 95, 1e-6);
}

TEST(Align, ReportsTheWorstPairBesideTheErrorToTheReference) {
  const auto step =
      align_step({}, round_at({300, 205, 395}), rig(3), believing(AlignPolicy::fixed_reference));
  EXPECT_EQ(step.decision.verdict, AlignVerdict::aligned);
  EXPECT_NEAR((*step.decision.worst_pair / kRow).value(), 190, 1e-6);
}

TEST(Align, FixedReferenceResetsEveryoneOutOfTolerance) {
  const AlignRound round = round_at({300, 401, 350, 10});
  const AlignOptions options{.policy = AlignPolicy::fixed_reference};
  const auto step = align_step({}, round, rig(4), options);
  EXPECT_EQ(step.decision.reference, 0u);
  EXPECT_THAT(reset_in(step.decision), testing::ElementsAre(1, 3));
  EXPECT_EQ(step.decision.cameras[1].reason, CameraReason{CameraCause::reset});
  EXPECT_THAT(said_to(1, round, rig(4), options), HasSubstr("101.0 rows"));
  EXPECT_THAT(said_to(1, round, rig(4), options), HasSubstr("before the target"));
}

TEST(Align, ErrorsGoRoundTheFramePeriodNotTheRows) {
  const auto step = align_step({}, round_at({5, 715}), rig(2), believing(AlignPolicy::fixed_reference));
  EXPECT_EQ(step.decision.verdict, AlignVerdict::aligned);
  EXPECT_NEAR((*step.decision.cameras[1].error / kRow).value(), -62.4, 0.1);
}

/// Two rounds of still cameras, the flashes delayed by `delays`.
std::vector<AlignDecision> under_delays(AlignPolicy policy, const std::array<Seconds, 2>& delays) {
  const AlignOptions options = believing(policy);
  std::vector<AlignCamera> cameras = rig(4);
  for (AlignCamera& camera : cameras)
    camera.trim = FrameRateTrim{PartsPerMillion(100), PartsPerMillion(0.5), Seconds(0.08)};
  std::vector<AlignDecision> decisions;
  AlignState state;
  for (std::size_t k = 0; k < delays.size(); ++k) {
    AlignRound round = round_at({300, 318, 295, 306});
    round.at = TimePoint{} + Seconds(0.6) * static_cast<double>(k);
    round.strobe_phase = delays[k];
    for (CameraView& camera : round.cameras)
      camera.phase.tau = wrap_positive(camera.phase.tau + delays[k], options.period);
    AlignStep step = align_step(state, round, cameras, options);
    state = std::move(step.state);
    decisions.push_back(std::move(step.decision));
  }
  return decisions;
}

TEST(Align, TheStrobesDelayMovesTheTargetAndNothingElse) {
  const AlignOptions options;
  for (const AlignPolicy policy :
       {AlignPolicy::fixed_reference, AlignPolicy::densest, AlignPolicy::timed, AlignPolicy::trimmed}) {
    SCOPED_TRACE(name(policy));
    const auto plain = under_delays(policy, {Seconds(0), Seconds(0)});
    for (const std::array<Seconds, 2>& delays :
         {std::array{milliseconds(3), milliseconds(3)}, std::array{Seconds(0), milliseconds(17)},
          std::array{milliseconds(38), milliseconds(12)}}) {
      const auto delayed = under_delays(policy, delays);
      for (std::size_t k = 0; k < plain.size(); ++k) {
        EXPECT_EQ(delayed[k].verdict, plain[k].verdict);
        ASSERT_TRUE(plain[k].target && delayed[k].target);
        EXPECT_NEAR(wrap_symmetric(*delayed[k].target - *plain[k].target - delays[k], options.period).value(),
                    0, 1e-12);
        for (std::size_t i = 0; i < plain[k].cameras.size(); ++i) {
          const CameraDecision& a = plain[k].cameras[i];
          const CameraDecision& b = delayed[k].cameras[i];
          EXPECT_NEAR((*b.error - *a.error).value(), 0, 1e-12);
          EXPECT_EQ(b.reset, a.reset);
          ASSERT_EQ(b.trim.has_value(), a.trim.has_value());
          if (a.trim) {
            EXPECT_NEAR((*b.trim - *a.trim).value(), 0, 1e-6);
          }
        }
      }
    }
  }
}

TEST(Align, DensestTakesTheReferenceWhereMostCamerasLieAndResetsTheFarthestFirst) {
  const auto step = align_step({}, round_at({20, 300, 380, 340, 620}), rig(5), {});
  EXPECT_EQ(step.decision.reference, 3u);
  EXPECT_THAT(reset_in(step.decision), testing::ElementsAre(0));  // 320 rows away, camera 4 is 280
  EXPECT_EQ(step.decision.cameras[4].reason, CameraReason{CameraCause::waits});
}

TEST(Align, ABlindCameraIsNeverWithoutError) {
  const auto cameras = rig(2);
  const auto first = align_step({}, round_at({300, kBlind}), cameras, believing());
  EXPECT_EQ(first.decision.verdict, AlignVerdict::go_on);
  EXPECT_FALSE(first.decision.cameras[1].error);
  EXPECT_FALSE(first.decision.worst_pair);
  EXPECT_THAT(reset_in(first.decision), testing::IsEmpty());
  ASSERT_TRUE(first.decision.strobe_phase);

  // With the strobe moved the blind one shows, the other hides: each is remembered where it was seen.
  AlignRound second = round_at({kBlind, 0});
  second.at = TimePoint{} + Seconds(1);
  second.strobe_phase = *first.decision.strobe_phase;
  second.cameras[1].phase.tau = Rows(310) * kRow + second.strobe_phase;
  const auto step = align_step(first.state, second, cameras, believing());
  EXPECT_EQ(step.decision.verdict, AlignVerdict::aligned);
  EXPECT_NEAR((*step.decision.worst_pair / kRow).value(), 10, 1e-6);
}

TEST(Align, ARememberedPhaseMovesOnWithTheBeatAndAges) {
  const auto cameras = rig(2);
  AlignRound one = round_at({300, kBlind});
  one.period_offset = {PartsPerMillion(54), PartsPerMillion(1)};  // one row a second
  const auto first = align_step({}, one, cameras, {});
  AlignRound second = round_at({kBlind, 300});
  second.at = TimePoint{} + Seconds(10);
  second.period_offset = one.period_offset;
  const auto step = align_step(first.state, second, cameras, {});
  ASSERT_TRUE(step.decision.cameras[0].error);
  EXPECT_NEAR((*step.decision.worst_pair / kRow).value(), 10, 1e-6);
  second.at = TimePoint{} + Seconds(1000);
  EXPECT_FALSE(align_step(first.state, second, cameras, {}).decision.cameras[0].error);
}

TEST(Align, GivesUpNamingTheCameraThatNeverShowsADot) {
  const auto cameras = rig(3);
  AlignStep step;
  std::vector<Seconds> phases;
  while (step.decision.verdict == AlignVerdict::go_on) {
    AlignRound round = round_at({300, kBlind, 310});
    round.strobe_phase = step.decision.strobe_phase.value_or(Seconds(0));
    phases.push_back(round.strobe_phase);
    step = align_step(step.state, round, cameras, {});
  }
  EXPECT_EQ(step.decision.verdict, AlignVerdict::given_up);
  EXPECT_EQ(step.decision.reason.cause, AlignCause::unseen);
  EXPECT_THAT(step.decision.reason.cameras, testing::Contains(1u));
  EXPECT_EQ(step.decision.reason.looks, 7);
  EXPECT_EQ(phases.size(), 7u);
  std::sort(phases.begin(), phases.end());
  for (std::size_t i = 1; i < phases.size(); ++i) EXPECT_GT(phases[i] - phases[i - 1], milliseconds(2));
}

TEST(Align, AnUnreadableCameraNeedsAHandNotAnotherStrobePhase) {
  AlignRound round = round_at({300, 310});
  round.cameras[1].phase = {PhaseState::unusable, {}, {}, "no lamp in view"};
  const auto step = align_step({}, round, rig(2), {});
  EXPECT_FALSE(step.decision.strobe_phase);
  EXPECT_EQ(step.decision.cameras[1].reason, CameraReason{CameraCause::unreadable});
  EXPECT_THAT(said_to(1, round, rig(2), {}), HasSubstr("no lamp in view"));
}

TEST(Align, ACameraThatCannotBeResetBecomesTheReference) {
  auto cameras = rig(4);
  cameras[3].method = ShutterReset::none;
  const auto step = align_step({}, round_at({300, 310, 320, 600}), cameras, {});
  EXPECT_EQ(step.decision.reference, 3u);
  cameras[0].method = ShutterReset::none;
  const auto stuck = align_step({}, round_at({300, 310, 320, 600}), cameras, {});
  EXPECT_EQ(stuck.decision.verdict, AlignVerdict::given_up);
  EXPECT_THAT(reset_in(stuck.decision), testing::IsEmpty());
}

TEST(Align, ATimedResetLandsOnTheReference) {
  // The camera's frames are stamped at 10 ms modulo T and it reads 200 rows before the reference; its reset
  // takes 7 ms.
  auto cameras = rig(2);
  cameras[1].expected_delay = ResetDelay{milliseconds(7), milliseconds(0.2)};
  AlignRound round = round_at({300, 500});
  round.cameras[1].stamp = TimePoint{} + milliseconds(10);
  AlignOptions options{.policy = AlignPolicy::timed};
  options.tolerance.amount = Rows(10);
  const auto step = align_step({}, round, cameras, options);
  const AlignDecision& d = step.decision;
  ASSERT_EQ(d.reference, 0u);
  ASSERT_TRUE(d.cameras[1].moment);
  // Its read phase must start 200 rows later than now.
  EXPECT_NEAR((*d.cameras[1].moment - TimePoint{}).value(), 10e-3 + 200 * 54e-6 - 7e-3, 1e-9);
}

TEST(Align, AnOperatorsResetIsNeverTimed) {
  AlignOptions options{.policy = AlignPolicy::timed};
  const auto step = align_step({}, round_at({300, 600}), rig(2, ShutterReset::by_hand), options);
  EXPECT_THAT(reset_in(step.decision), testing::ElementsAre(1));
  EXPECT_FALSE(step.decision.cameras[1].moment);
  EXPECT_EQ(step.decision.cameras[1].reason, CameraReason{CameraCause::by_hand});
}

TEST(Align, OneCameraOfAModelTeachesWhileTheOthersWait) {
  const AlignOptions options{.policy = AlignPolicy::timed};
  const AlignRound round = round_at({300, 600, 610, 310});
  const auto step = align_step({}, round, rig(4), options);
  EXPECT_EQ(reset_in(step.decision).size(), 1u);
  EXPECT_THAT(said_to(2, round, rig(4), options), HasSubstr("waits until another ccd has taught"));
}

TEST(Align, EachResetTeachesItsDelayWhateverThePolicy) {
  const auto cameras = rig(2);
  AlignRound round = round_at({300, 500});
  round.cameras[1].stamp = TimePoint{} + Seconds(1.5);
  round.resets = {{1, TimePoint{} + Seconds(1.0)}};
  const auto step = align_step({}, round, cameras, {.policy = AlignPolicy::fixed_reference});
  ASSERT_TRUE(step.state.cameras[1].delay);
  EXPECT_NEAR(step.state.cameras[1].delay->mean.value(), wrap_positive(0.5, 1 / 23.976), 1e-9);
  EXPECT_EQ(step.decision.resets_so_far, 1);
}

// The delay that was told is wrong by 3 ms, fifteen times its claimed error: the first miss corrects it.
TEST(Align, BiasedResetLatencyIsUnlearnt) {
  AlignSimulation sim;
  sim.options.policy = AlignPolicy::timed;
  sim.options.tolerance.amount = Rows(10);
  sim.delay_known = true;
  sim.latency_bias = milliseconds(3);
  const auto counts = simulate_many(sim, 50);
  EXPECT_EQ(counts.aligned, 50);
  EXPECT_LT(counts.resets, 20);
}

TEST(Align, StopsAfterTheRoundsAllowed) {
  AlignSimulation sim;
  sim.options.policy = AlignPolicy::fixed_reference;
  sim.options.tolerance.amount = Rows(3);
  sim.options.max_rounds = 20;
  const auto outcome = simulate(sim, 1);
  EXPECT_EQ(outcome.decision.verdict, AlignVerdict::given_up);
  EXPECT_THAT(outcome.words.reason, HasSubstr("20 rounds"));
}

struct Bound {
  AlignPolicy policy;
  bool delay_known;
  double mean;
};

// bench_align_policies prints the same over 1000 rigs: 28.5, 16.2, 5.4 and 8.9; means over 300 scatter by
// 0.6, 0.4, 0.1 and 0.1.
TEST(Align, MeanResetsOfElevenCamerasTo100Rows) {
  for (const Bound& bound :
       {Bound{AlignPolicy::fixed_reference, false, 30.5}, Bound{AlignPolicy::densest, false, 18},
        Bound{AlignPolicy::timed, true, 6.0}, Bound{AlignPolicy::timed, false, 10}}) {
    AlignSimulation sim;
    sim.options.policy = bound.policy;
    sim.delay_known = bound.delay_known;
    sim.latency_spread = milliseconds(bound.delay_known ? 0 : 10);
    const auto counts = simulate_many(sim, 300);
    EXPECT_EQ(counts.aligned, 300) << name(bound.policy);
    EXPECT_LT(counts.resets, bound.mean) << name(bound.policy);
  }
}

TEST(Align, WhatItCallsAlignedIsAligned) {
  for (const auto policy : {AlignPolicy::fixed_reference, AlignPolicy::densest, AlignPolicy::timed}) {
    AlignSimulation sim;
    sim.options.policy = policy;
    sim.rate_spread = PartsPerMillion(10);
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
      const auto outcome = simulate(sim, seed);
      ASSERT_EQ(outcome.decision.verdict, AlignVerdict::aligned);
      EXPECT_LT(outcome.true_worst_rows, 102) << name(policy) << " seed " << seed;
    }
  }
}

TEST(Tolerance, ParsesRowsAndTimes) {
  EXPECT_NEAR(parse_tolerance("100rows")->in_time(kRow).value(), 5.4e-3, 1e-15);
  EXPECT_NEAR(parse_tolerance("5.4ms")->in_rows(kRow).value(), 100, 1e-9);
  EXPECT_NEAR(parse_tolerance("500us")->in_time(kRow).value(), 500e-6, 1e-15);
}

TEST(Tolerance, RefusesWhatIsNoToleranceAndSaysHow) {
  for (const char* text :
       {"", "rows", "100", "-5rows", "0ms", "nanms", "1e999rows", "5 rows", "100 furlongs", "infus"}) {
    const auto refused = parse_tolerance(text);
    ASSERT_FALSE(refused.ok()) << text;
    EXPECT_THAT(refused.error().message(), HasSubstr("0.5ms, 500us or 10rows"));
  }
}

TEST(Policy, NamesGoThereAndBack) {
  for (const auto policy : {AlignPolicy::fixed_reference, AlignPolicy::densest, AlignPolicy::timed}) {
    EXPECT_EQ(*parse_align_policy(name(policy)), policy);
  }
  EXPECT_THAT(parse_align_policy("best").error().message(),
              HasSubstr("fixed-reference, densest, timed or trimmed"));
}

TEST(Tolerance, FollowsFromTheFlamesSpeedAndIsSaidInTimeAndRows) {
  const Tolerance usual = tolerance_for({});
  EXPECT_DOUBLE_EQ(std::get<Seconds>(usual.amount).value(), 0.5e-3);
  // Two cameras at its two ends see a detail of 4 mm at 2 m/s displaced by half of it.
  EXPECT_DOUBLE_EQ(2 * 2 * std::get<Seconds>(usual.amount).value(), 0.5 * 0.004);
  EXPECT_DOUBLE_EQ(tolerance_for({MetersPerSecond(4), Meters(0.002)}).in_time(kRow).value(), 0.125e-3);
  EXPECT_EQ(words(usual, microseconds_per_row(54)), "0.500 ms (9.3 rows)");
  EXPECT_EQ(words(Tolerance{Rows(100)}, microseconds_per_row(54)), "5.40 ms (100 rows)");
  EXPECT_EQ(words(Tolerance{Rows(1)}, microseconds_per_row(54)), "0.0540 ms (1.0 rows)");
}

}  // namespace
}  // namespace emberlock::smear
