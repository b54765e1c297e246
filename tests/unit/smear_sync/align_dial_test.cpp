// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align_dial.h"

#include <functional>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "smear_sync/align/align_words.h"

namespace emberlock::smear {
namespace {

using testing::HasSubstr;

AlignOptions dialled() {
  AlignOptions options;
  options.dial = StrobeDial{};
  return options;
}

std::vector<AlignCamera> dialled_rig(std::size_t n) {
  std::vector<AlignCamera> cameras;
  for (std::size_t i = 0; i < n; ++i)
    cameras.push_back({"cam" + std::to_string(i), "ccd", ShutterReset::on_command, {}});
  return cameras;
}

/// Three cameras at these taus under flashes of a rate, at an instant.
AlignRound walking_round(double seconds, Hertz rate, const std::vector<double>& taus_ms) {
  AlignRound round;
  round.at = TimePoint{} + Seconds(seconds);
  round.flashes = {FlashesSeen::rate, rate, PartsPerMillion(50), {}, static_cast<int>(taus_ms.size())};
  round.period_offset = expected_period_offset(rate, AlignOptions{}.period, PartsPerMillion(50));
  for (const double tau : taus_ms) {
    CameraView view;
    view.phase = {PhaseState::known, milliseconds(tau), microseconds(10), {}};
    view.stamp = round.at;
    round.cameras.push_back(view);
  }
  return round;
}

TEST(AlignDial, SaysWhichWayAndByHowMuchToTurn) {
  const AlignRound fast = walking_round(0, Hertz(1510.5 / 60), {3, 5, 7});
  const auto step = align_step({}, fast, dialled_rig(3), dialled());
  ASSERT_TRUE(step.decision.dial);
  EXPECT_TRUE(step.decision.dial->act);
  EXPECT_EQ(step.decision.verdict, AlignVerdict::go_on);
  const AlignWords said = words(step.decision, fast, dialled_rig(3), dialled());
  EXPECT_EQ(said.reason, said.dial);
  EXPECT_EQ(
      said.reason,
      "the strobe flashes at 1510.5 a minute: turn it down by 71.9 (4.76 %), to 1438.6 flashes a minute "
      "(23.977 Hz)");
  AlignRound slow = walking_round(0, Hertz(719.3 / 60), {3, 5, 7});
  slow.flashes.others = {Hertz(1438.6 / 60)};
  const auto half = align_step({}, slow, dialled_rig(3), dialled());
  const AlignWords to_half = words(half.decision, slow, dialled_rig(3), dialled());
  EXPECT_THAT(to_half.reason, HasSubstr("turn it up by 719.3 (100 %)"));
  EXPECT_THAT(to_half.reason, HasSubstr("(or at 1438.6, if all the flashes between fall where no camera"));
}

TEST(AlignDial, WhatIsFollowedGoesByTheToleranceAndTheStep) {
  AlignOptions options = dialled();
  options.tolerance.amount = Rows(100);
  EXPECT_NEAR(followed_at_most(options), 0.005, 1e-12);
  options.tolerance.amount = Rows(10);
  EXPECT_NEAR(followed_at_most(options), 0.1 * 540e-6 * 23.976, 1e-9);
  options.dial->step = Hertz(1.0 / 60);
  EXPECT_NEAR(followed_at_most(options), 2.0 / 60 / 23.976, 1e-9) << "two steps of the dial";
}

// The cameras stand still against each other, while the flashes walk 5 ms in two seconds.
TEST(AlignDial, AWalkIsTakenOutAndDotsAreSeenToFollowIt) {
  const Hertz rate(23.976 / 1.0025);
  AlignState state;
  AlignDecision last;
  const AlignOptions options = dialled();
  for (int i = 0; i < 10; ++i) {
    const double t = 0.5 * i;
    const double walked = 2.5 * t;
    const auto step = align_step(state, walking_round(t, rate, {3 + walked, 4 + walked, 5 + walked}),
                                 dialled_rig(3), options);
    state = step.state;
    last = step.decision;
    EXPECT_FALSE(last.strobe_phase) << "no strobe is moved that nobody can talk to";
    if (last.verdict == AlignVerdict::aligned) break;
  }
  EXPECT_EQ(last.verdict, AlignVerdict::aligned);
  EXPECT_NEAR(in_milliseconds(*last.worst_pair), 2, 0.05);
  for (const CameraTrack& camera : state.cameras) EXPECT_TRUE(camera.moved);
}

struct LastRound {
  AlignDecision decision;
  AlignWords words;
};

/// Runs half-second rounds till a verdict, under flashes that walk 1.25 ms in each; `taus` of what they
/// walked.
template <typename Taus>
LastRound until_told(std::size_t cameras, const Taus& taus, const std::function<void(AlignRound&)>& show) {
  const AlignOptions options = dialled();
  AlignState state;
  LastRound last;
  for (int i = 0; i < 300; ++i) {
    AlignRound round = walking_round(0.5 * i, Hertz(23.976 / 1.0025), taus(1.25 * i));
    for (CameraView& camera : round.cameras)
      camera.phase.tau = wrap_positive(camera.phase.tau, options.period);
    if (show) show(round);
    AlignStep step = align_step(state, round, dialled_rig(cameras), options);
    state = std::move(step.state);
    last.words = words(step.decision, round, dialled_rig(cameras), options);
    last.decision = std::move(step.decision);
    if (last.decision.verdict != AlignVerdict::go_on) break;
  }
  return last;
}

/// The one camera is seen alone in two rounds of six, and its own dots tell this rate.
std::function<void(AlignRound&)> often_alone(std::size_t camera, double rate_ratio) {
  return [camera, rate_ratio, n = 0](AlignRound& round) mutable {
    const bool alone = ++n % 6 > 3;
    const OwnFlashes own{Hertz(23.976 * rate_ratio), PartsPerMillion(50), alone};
    round.flashes.own.assign(round.cameras.size(), OwnFlashes{round.flashes.rate, round.flashes.sigma, true});
    round.flashes.own[camera] = own;
    if (!alone) return;
    round.flashes.rate = own.rate;
    round.flashes.cameras = 1;
    round.period_offset = expected_period_offset(own.rate, AlignOptions{}.period, own.sigma);
    for (std::size_t i = 0; i < round.cameras.size(); ++i) {
      if (i == camera) continue;
      round.flashes.own[i].reset();
      round.cameras[i].phase = {PhaseState::blind, {}, {}, "clean column"};
    }
  };
}

TEST(AlignDial, ADotThatStandsStillIsNoCamerasDot) {
  const auto stands = [](double walked) {
    return std::vector<double>{3 + walked, 4 + walked, 5 + walked, 4.5};
  };
  const LastRound seen = until_told(4, stands, {});
  EXPECT_EQ(seen.decision.verdict, AlignVerdict::given_up);
  EXPECT_THAT(seen.words.reason, HasSubstr("no phase of cam3 after"));
  EXPECT_THAT(seen.words.reason, HasSubstr("look for a reflection of the lamp"));
  const LastRound alone = until_told(4, stands, often_alone(3, 1));
  EXPECT_EQ(alone.decision.verdict, AlignVerdict::given_up);
  EXPECT_THAT(alone.words.reason, HasSubstr("no phase of cam3 after"));
  EXPECT_THAT(alone.words.reason, HasSubstr("look for a reflection of the lamp"));
}

TEST(AlignDial, ACameraThatIsReadTheOtherWayIsNoWitnessToItself) {
  const auto against = [](double walked) {
    return std::vector<double>{3 + walked, 4 + walked, 5 + walked, 4.5 - walked};
  };
  const LastRound seen = until_told(4, against, {});
  EXPECT_EQ(seen.decision.verdict, AlignVerdict::given_up);
  EXPECT_THAT(seen.words.reason, HasSubstr("no phase of cam3 after"));
  EXPECT_THAT(seen.words.reason, HasSubstr("set its read direction the other way round"));
  const LastRound alone = until_told(4, against, often_alone(3, 1.0025));
  EXPECT_EQ(alone.decision.verdict, AlignVerdict::given_up);
  EXPECT_THAT(alone.words.reason, HasSubstr("no phase of cam3 after"));
  EXPECT_THAT(alone.words.reason, HasSubstr("set its read direction the other way round"));
}

TEST(AlignDial, OfTwoCamerasThatWalkApartNobodyCanSayWhichIsRight) {
  const auto apart = [](double walked) { return std::vector<double>{3 + walked, 4 - walked}; };
  const LastRound seen = until_told(2, apart, {});
  EXPECT_EQ(seen.decision.verdict, AlignVerdict::given_up);
  EXPECT_EQ(seen.decision.resets_so_far, 0);
  EXPECT_THAT(seen.words.reason, HasSubstr("no phase of cam0, cam1 after"));
  EXPECT_THAT(seen.words.reason, HasSubstr("whether the read direction of each is set right"));
}

TEST(AlignDial, FlashesThatStandStillAreAskedToWalk) {
  AlignState state;
  AlignDecision last;
  AlignWords said;
  for (int i = 0; i < 4; ++i) {
    const AlignRound round = walking_round(0.5 * i, Hertz(23.976), {3, 4, 5});
    const auto step = align_step(state, round, dialled_rig(3), dialled());
    state = step.state;
    last = step.decision;
    said = words(last, round, dialled_rig(3), dialled());
    EXPECT_EQ(last.verdict, AlignVerdict::go_on);
  }
  ASSERT_TRUE(last.dial);
  EXPECT_TRUE(last.dial->act);
  EXPECT_THAT(said.dial, HasSubstr("the flashes stand nearly still in the frames: turn it up by 3.6"));
  EXPECT_THAT(said.dial, HasSubstr("so that dots are seen to follow them"));
  EXPECT_NEAR(last.dial->set.value(), 23.976 * 1.0025, 1e-3);
  EXPECT_LT(state.looks, AlignOptions{}.max_looks) << "who waits for people gives up on nobody";
}

TEST(AlignDial, ResetsOfRoundsThatWaitForItAreLearntLater) {
  const AlignOptions options = dialled();
  const Hertz good(1441.0 / 60);
  AlignRound bad = walking_round(0, Hertz(1510.5 / 60), {3, 4, 5});
  bad.resets = {{1, TimePoint{}}};
  auto step = align_step({}, bad, dialled_rig(3), options);
  EXPECT_EQ(step.state.resets, 0);
  step = align_step(step.state, walking_round(1, good, {3, 4, 5}), dialled_rig(3), options);
  EXPECT_EQ(step.state.resets, 1);
  EXPECT_EQ(step.state.cameras[1].taught, 1);
  EXPECT_TRUE(step.state.dial.resets.empty());
}

TEST(AlignDial, AllCamerasBlindForAMomentIsNoReasonToTurnIt) {
  const AlignOptions options = dialled();
  const auto first = align_step({}, walking_round(0, Hertz(1441.0 / 60), {3, 4, 5}), dialled_rig(3), options);
  AlignRound blind = walking_round(0.5, Hertz(0), {0, 0, 0});
  blind.flashes = {FlashesSeen::hidden, {}, {}, {}, 0};
  for (CameraView& camera : blind.cameras) camera.phase = {PhaseState::blind, {}, {}, "clean column"};
  const auto step = align_step(first.state, blind, dialled_rig(3), options);
  ASSERT_TRUE(step.decision.dial);
  EXPECT_FALSE(step.decision.dial->act);
  const auto cold = align_step({}, blind, dialled_rig(3), options);
  EXPECT_TRUE(cold.decision.dial->act);
  EXPECT_THAT(words(cold.decision, blind, dialled_rig(3), options).reason,
              HasSubstr("every flash falls where no camera shows it: turn the strobe"));
}

}  // namespace
}  // namespace emberlock::smear
