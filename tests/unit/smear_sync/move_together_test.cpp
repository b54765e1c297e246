// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/move_together.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "smear_sync/align/align_simulation.h"

namespace emberlock::smear {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr Seconds kCommonPeriod{1 / 23.976};
const Seconds kMoved = milliseconds(2);
constexpr auto kWith = DotMotion::with_all;

/// The strobe was moved by 2 ms, and the camera's tau by so many.
DotMove moved_by(double ms, double sigma_ms = 0.02) {
  return {kMoved, kMoved, milliseconds(ms), milliseconds(sigma_ms)};
}

std::vector<DotMotion> motions_of(const std::vector<std::optional<DotMove>>& cameras) {
  return move_together(cameras, kCommonPeriod);
}

TEST(MoveTogether, ASpotThatStandsOrMovesOtherwiseIsFound) {
  EXPECT_THAT(motions_of({moved_by(2.01), moved_by(1.98), moved_by(0.03), moved_by(-2), moved_by(7)}),
              ElementsAre(kWith, kWith, DotMotion::none, DotMotion::against, DotMotion::otherwise));
}

TEST(MoveTogether, OfTwoCamerasTheOneThatFollowsTheStrobeIsBelieved) {
  EXPECT_THAT(motions_of({moved_by(0), moved_by(2)}), ElementsAre(DotMotion::none, kWith));
  EXPECT_THAT(motions_of({moved_by(2)}), ElementsAre(kWith));
}

// The strobe's time base is off, or the beat is: what all dots share says nothing against one of them.
TEST(MoveTogether, WhatAllCamerasShareSpeaksAgainstNone) {
  EXPECT_THAT(
      motions_of({moved_by(2.5), moved_by(2.49), moved_by(2.52), moved_by(2.5), moved_by(2), moved_by(0)}),
      ElementsAre(kWith, kWith, kWith, kWith, DotMotion::otherwise, DotMotion::none));
}

TEST(MoveTogether, AMoveGoesRoundTheFramePeriod) {
  DotMove across = moved_by(2);
  across.strobe = across.strobe - kCommonPeriod;
  across.seen = across.seen + kCommonPeriod;
  EXPECT_THAT(motions_of({across, moved_by(2)}), ElementsAre(kWith, kWith));
}

TEST(MoveTogether, WhatWasntSeenTwiceOrIsKnownTooRoughlyIsNotTold) {
  EXPECT_THAT(motions_of({std::nullopt, moved_by(0, 0.3), moved_by(2)}),
              ElementsAre(DotMotion::untold, DotMotion::untold, kWith));
  DotMove drifted = moved_by(2);
  drifted.strobe = Seconds(0);  // nothing that would tell a dot
  EXPECT_THAT(motions_of({drifted}), ElementsAre(DotMotion::untold));
}

/// Two cameras in step and one, `odd`, whose tau answers to the strobe's delay by `gain`: 1 is a dot's, 0 a
/// reflection's, -1 one whose read direction is set wrong.
class ThreeCameras {
 public:
  explicit ThreeCameras(double gain) : gains_{1, 1, gain} {}

  AlignStep round() {
    AlignRound round;
    round.at = TimePoint{} + Seconds(0.6) * rounds_++;
    round.strobe_phase = strobe_;
    for (const double gain : gains_) {
      const Seconds tau = milliseconds(16) + gain * strobe_;
      round.cameras.push_back(
          {{PhaseState::known, wrap_positive(tau, kCommonPeriod), microseconds(16), {}}, {}});
    }
    if (rough_ > Seconds(0)) round.cameras[2].phase.sigma = rough_;
    AlignStep step = align_step(state_, round, cameras_, {});
    state_ = step.state;
    strobe_ = step.decision.strobe_phase.value_or(strobe_);
    said_ = words(step.decision, round, cameras_, {});
    return step;
  }
  /// Of the last round.
  [[nodiscard]] const AlignWords& said() const { return said_; }
  void heal() { gains_[2] = 1; }
  /// The third one's phases are known to this.
  void roughen(Seconds sigma) { rough_ = sigma; }

 private:
  std::vector<double> gains_;
  std::vector<AlignCamera> cameras_{{"a", "ccd", ShutterReset::on_command, {}, {}},
                                    {"b", "ccd", ShutterReset::on_command, {}, {}},
                                    {"c", "ccd", ShutterReset::on_command, {}, {}}};
  AlignState state_;
  AlignWords said_;
  Seconds strobe_;
  Seconds rough_;
  int rounds_ = 0;
};

TEST(MoveTogether, CamerasAreAlignedOnceTheirDotsWereSeenToMove) {
  ThreeCameras rig(1);
  const AlignDecision first = rig.round().decision;
  EXPECT_EQ(first.verdict, AlignVerdict::go_on);
  ASSERT_TRUE(first.strobe_phase);
  EXPECT_NEAR(in_milliseconds(*first.strobe_phase), 2, 1e-9);
  EXPECT_THAT(rig.said().reason, HasSubstr("the dot of a, b, c must follow"));
  EXPECT_EQ(rig.round().decision.verdict, AlignVerdict::aligned);
  EXPECT_EQ(rig.round().decision.verdict, AlignVerdict::aligned) << "and stay so";
}

TEST(MoveTogether, AReflectionIsNeverTakenAsInPhase) {
  ThreeCameras rig(0);
  AlignDecision decision = rig.round().decision;
  for (int i = 0; decision.verdict == AlignVerdict::go_on; ++i) {
    ASSERT_LT(i, 20);
    decision = rig.round().decision;
    EXPECT_EQ(decision.cameras[2].state, PhaseState::unusable);
    EXPECT_FALSE(decision.cameras[2].error);
    EXPECT_THAT(rig.said().cameras[2], HasSubstr("stood still"));
    EXPECT_EQ(decision.cameras[0].state, PhaseState::known);
    for (const CameraDecision& camera : decision.cameras) EXPECT_FALSE(camera.reset);
  }
  EXPECT_EQ(decision.verdict, AlignVerdict::given_up);
  EXPECT_THAT(rig.said().reason, HasSubstr("no phase of c"));
  EXPECT_THAT(rig.said().reason, HasSubstr("look for a reflection"));
}

TEST(MoveTogether, AReflectionThatIsShadedIsForgotten) {
  ThreeCameras rig(0);
  (void)rig.round();
  (void)rig.round();
  rig.heal();
  AlignDecision decision = rig.round().decision;
  for (int i = 0; i < 3 && decision.verdict == AlignVerdict::go_on; ++i) decision = rig.round().decision;
  EXPECT_EQ(decision.verdict, AlignVerdict::aligned) << rig.said().reason;
}

// In tolerance, but known to a fifth of the strobe's step: neither moved nor standing.
TEST(MoveTogether, ADotThatIsKnownTooRoughlyIsNotSaidToBeUnseen) {
  ThreeCameras rig(1);
  rig.roughen(milliseconds(0.4));
  AlignDecision decision = rig.round().decision;
  for (int i = 0; decision.verdict == AlignVerdict::go_on; ++i) {
    ASSERT_LT(i, 20);
    decision = rig.round().decision;
  }
  EXPECT_EQ(decision.verdict, AlignVerdict::given_up);
  EXPECT_THAT(rig.said().reason, HasSubstr("the phase of c is known to"));
  EXPECT_THAT(rig.said().reason, HasSubstr("too roughly to see it follow the strobe by 2.00 ms"));
  EXPECT_THAT(rig.said().reason, testing::Not(HasSubstr("no dot")));
}

TEST(MoveTogether, TwoPhasesKnownToTheStatedPartOfTheStepTellAMove) {
  const double sigma = kToldPartOfStep * in_milliseconds(kMoved) * std::sqrt(2.0);
  EXPECT_THAT(motions_of({moved_by(2, sigma)}), ElementsAre(kWith));
  EXPECT_THAT(motions_of({moved_by(0, sigma), moved_by(2)}), ElementsAre(DotMotion::none, kWith));
}

TEST(MoveTogether, AWrongReadDirectionIsNamed) {
  ThreeCameras rig(-1);
  (void)rig.round();
  (void)rig.round();
  EXPECT_THAT(rig.said().cameras[2], HasSubstr("set its read direction the other way"));
}

TEST(MoveTogether, AStrobeThatDoesntObeyIsNamedNotTheCameras) {
  AlignRound round;
  for (int i = 0; i < 2; ++i)
    round.cameras.push_back({{PhaseState::known, milliseconds(16), microseconds(16), {}}, {}});
  const std::vector<AlignCamera> cameras{{"a", "ccd", ShutterReset::on_command, {}, {}},
                                         {"b", "ccd", ShutterReset::on_command, {}, {}}};
  const AlignStep first = align_step({}, round, cameras, {});
  round.at = round.at + Seconds(0.6);
  round.strobe_phase = *first.decision.strobe_phase;
  const AlignDecision second = align_step(first.state, round, cameras, {}).decision;
  for (const std::string& sentence : words(second, round, cameras, {}).cameras)
    EXPECT_THAT(sentence, HasSubstr("whether the strobe does as it is told"));
}

// Rows that whole-row shifts leave unsure, drifts, resets and trims: no true dot comes into doubt.
TEST(MoveTogether, NoTrueDotIsDoubted) {
  AlignSimulation sim;
  sim.flash_rows = 0.37;
  sim.noise_rows = 0.05;
  sim.rate_spread = PartsPerMillion(20);
  sim.trim = FrameRateTrim{PartsPerMillion(100), PartsPerMillion(0.5), milliseconds(80)};
  for (const auto policy :
       {AlignPolicy::fixed_reference, AlignPolicy::densest, AlignPolicy::timed, AlignPolicy::trimmed}) {
    sim.options.policy = policy;
    for (std::uint64_t seed = 0; seed < 100; ++seed) {
      const AlignOutcome outcome = simulate(sim, seed);
      EXPECT_EQ(outcome.decision.verdict, AlignVerdict::aligned) << seed;
      for (const CameraTrack& camera : outcome.state.cameras) {
        EXPECT_TRUE(camera.moved) << seed;
        EXPECT_FALSE(camera.doubt) << seed;
      }
    }
  }
}

}  // namespace
}  // namespace emberlock::smear
