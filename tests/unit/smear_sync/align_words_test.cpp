// SPDX-License-Identifier: Apache-2.0
// Decisions are codes and numbers; sentences are made from them, each code its own.
#include "smear_sync/align/align_words.h"

#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace emberlock::smear {
namespace {

using testing::HasSubstr;

const std::vector<AlignCamera> kThree{{"a", "ccd", ShutterReset::on_command, {}, {}},
                                      {"b", "ccd", ShutterReset::on_command, {}, {}},
                                      {"c", "ccd", ShutterReset::by_hand, {}, {}}};

/// Two cameras that are seen and one whose picture says `why` it isn't.
AlignRound one_unreadable(const std::string& why) {
  AlignRound round;
  for (const double ms : {16.0, 17.0})
    round.cameras.push_back({{PhaseState::known, milliseconds(ms), microseconds(16), {}}, {}});
  round.cameras.push_back({{PhaseState::unusable, {}, {}, why}, {}});
  return round;
}

AlignDecision decision_of(std::size_t cameras) {
  AlignDecision decision;
  decision.cameras.resize(cameras);
  for (CameraDecision& camera : decision.cameras) camera.error = milliseconds(1);
  return decision;
}

TEST(AlignWords, ARewordedPictureChangesTheSentencesAndNoDecision) {
  AlignState before;
  AlignState after;
  for (int i = 0; i < 8; ++i) {
    const AlignRound once = one_unreadable("no lamp in view");
    const AlignRound reworded = one_unreadable("the lamp isn't in view");
    const AlignStep a = align_step(before, once, kThree, {});
    const AlignStep b = align_step(after, reworded, kThree, {});
    EXPECT_EQ(a.decision.verdict, b.decision.verdict);
    EXPECT_EQ(a.decision.reason, b.decision.reason);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(a.decision.cameras[c].reason, b.decision.cameras[c].reason);
    EXPECT_THAT(words(a.decision, once, kThree, {}).cameras[2], HasSubstr("(no lamp in view)"));
    EXPECT_THAT(words(b.decision, reworded, kThree, {}).cameras[2], HasSubstr("(the lamp isn't in view)"));
    before = a.state;
    after = b.state;
    if (i < 7) continue;
    EXPECT_EQ(a.decision.reason.cause, AlignCause::unseen);
    EXPECT_THAT(words(a.decision, once, kThree, {}).reason, HasSubstr("strobe: no lamp in view"));
  }
}

TEST(AlignWords, EveryCauseOfACameraHasASentenceOfItsOwn) {
  const AlignRound round = one_unreadable("no lamp in view");
  std::set<std::string> said;
  int codes = 0;
  for (const AlignGoal goal : {AlignGoal::tolerance, AlignGoal::reach}) {
    said.clear();
    codes = 0;
    for (auto cause = CameraCause::stands; cause <= CameraCause::waits_for_dial;
         cause = static_cast<CameraCause>(static_cast<int>(cause) + 1)) {
      AlignDecision decision = decision_of(3);
      decision.goal = goal;
      decision.cameras[0].reason = {.cause = cause,
                                    .stay = Seconds(3),
                                    .trim = PartsPerMillion(2),
                                    .after = 2,
                                    .doubt = Doubt{DoubtCause::against, milliseconds(2), milliseconds(-2)}};
      said.insert(words(decision, round, kThree, {}).cameras[0]);
      ++codes;
    }
    EXPECT_EQ(said.size(), static_cast<std::size_t>(codes));
    EXPECT_EQ(said.count(""), 0U);
  }
  EXPECT_EQ(words(decision_of(3), round, kThree, {}).cameras[0], "") << "nothing was looked at";
}

TEST(AlignWords, EveryDoubtAndTimingHasASentenceOfItsOwn) {
  const AlignRound round = one_unreadable("");
  AlignDecision decision = decision_of(3);
  std::set<std::string> said;
  for (auto cause = DoubtCause::strobe_stood; cause <= DoubtCause::stood_in_walk;
       cause = static_cast<DoubtCause>(static_cast<int>(cause) + 1)) {
    decision.cameras[1].reason = {.cause = CameraCause::doubted,
                                  .doubt = Doubt{cause, milliseconds(2), milliseconds(0.5)}};
    said.insert(words(decision, round, kThree, {}).cameras[1]);
  }
  EXPECT_EQ(said.size(), 7U);
  for (auto timing = ResetTiming::none; timing <= ResetTiming::teaches;
       timing = static_cast<ResetTiming>(static_cast<int>(timing) + 1)) {
    decision.cameras[1].reason = {.cause = CameraCause::reset, .timing = timing};
    said.insert(words(decision, round, kThree, {}).cameras[1]);
  }
  EXPECT_EQ(said.size(), 11U);
}

TEST(AlignWords, EveryCauseOfAVerdictHasASentenceOfItsOwn) {
  const AlignRound round = one_unreadable("");
  AlignOptions options;
  options.dial = StrobeDial{};
  std::set<std::string> said;
  int codes = 0;
  for (auto cause = AlignCause::untrimmable; cause <= AlignCause::dial;
       cause = static_cast<AlignCause>(static_cast<int>(cause) + 1)) {
    AlignDecision decision = decision_of(3);
    decision.dial.emplace().set = Hertz(23.976);
    decision.reason = {.cause = cause, .cameras = {0, 2}, .sigma = milliseconds(0.3), .looks = 7};
    if (cause == AlignCause::unmoved) decision.reason.unmoved = {0, 2};
    said.insert(words(decision, round, kThree, options).reason);
    ++codes;
  }
  EXPECT_EQ(said.size(), static_cast<std::size_t>(codes));
  EXPECT_EQ(said.count(""), 0U);
}

/// Of every cause, with and without cameras whose dot is rough or stood: only a run that ended has a remedy,
/// and it doesn't ask for the opposite of what the reason does.
TEST(AlignWords, ARemedyNeverContradictsItsReason) {
  AlignOptions options;
  options.dial = StrobeDial{};
  const auto asks = [](const std::string& text, const char* word) {
    return text.find(word) != std::string::npos;
  };
  for (auto cause = AlignCause::untrimmable; cause <= AlignCause::dial;
       cause = static_cast<AlignCause>(static_cast<int>(cause) + 1))
    for (const bool rough : {false, true})
      for (const auto verdict :
           {AlignVerdict::go_on, AlignVerdict::aligned, AlignVerdict::refused, AlignVerdict::given_up}) {
        AlignDecision decision = decision_of(3);
        decision.verdict = verdict;
        decision.dial.emplace().set = Hertz(23.976);
        decision.reason = {
            .cause = cause, .cameras = {0, 2}, .sigma = milliseconds(0.3), .looks = 7, .rounds = 5};
        (rough ? decision.reason.rough : decision.reason.unmoved) = {0, 2};
        const AlignWords said = words(decision, one_unreadable(""), kThree, options);
        const bool ended = verdict == AlignVerdict::refused || verdict == AlignVerdict::given_up;
        EXPECT_EQ(said.remedy.empty(), !ended) << said.remedy;
        EXPECT_FALSE(asks(said.reason, "finer") && asks(said.remedy, "wider")) << said.reason << said.remedy;
        EXPECT_FALSE(asks(said.reason, "or more") && asks(said.remedy, "finer"))
            << said.reason << said.remedy;
      }
}

TEST(AlignWords, EveryCauseOfADialHasASentenceOfItsOwn) {
  const AlignRound round = one_unreadable("");
  AlignOptions options;
  options.dial = StrobeDial{};
  std::set<std::string> said;
  const auto say = [&](DialCause cause, FlashesSeen seen) {
    AlignDecision decision = decision_of(3);
    DialAdvice& advice = decision.dial.emplace();
    advice.set = Hertz(24);
    if (seen == FlashesSeen::rate) advice.measured = Hertz(23);
    advice.cause = cause;
    advice.seen = seen;
    said.insert(words(decision, round, kThree, options).dial);
  };
  for (const auto cause : {DialCause::leave, DialCause::out_of_sight, DialCause::turn_off_rate})
    say(cause, FlashesSeen::rate);
  for (auto seen = FlashesSeen::rate; seen <= FlashesSeen::none;
       seen = static_cast<FlashesSeen>(static_cast<int>(seen) + 1))
    say(DialCause::set, seen);
  EXPECT_EQ(said.size(), 9U);
  EXPECT_EQ(said.count(""), 0U);
  EXPECT_EQ(words(decision_of(3), round, kThree, options).dial, "");
}

TEST(AlignWords, SentencesOfOneVerdict) {
  const AlignRound round = one_unreadable("");
  AlignDecision decision = decision_of(3);
  const auto reason = [&] { return words(decision, round, kThree, {}).reason; };
  decision.reason = {.cause = AlignCause::out, .cameras = {1}};
  EXPECT_EQ(reason(), "1 camera out of tolerance");
  decision.reason.cameras.push_back(2);
  decision.reason.rounds = 500;
  EXPECT_EQ(reason(), "not aligned after 500 rounds: 2 cameras out of tolerance");
  decision.reason = {.cause = AlignCause::within, .unmoved = {2}, .rough = {0}};
  EXPECT_EQ(reason(),
            "every camera lies within tolerance of the target; the strobe is moved by 2.00 ms, "
            "which the dot of c, a must follow");
  decision.reason = {.cause = AlignCause::within, .first_out = 1};
  decision.next_check = Seconds(612);
  EXPECT_EQ(reason(),
            "every camera lies within tolerance of the target; a take may be 10.2 min long, "
            "then b may have drifted out");
  decision.reason = {.cause = AlignCause::drift_unknown, .cameras = {0, 2}};
  EXPECT_EQ(reason(),
            "every camera lies within tolerance of the target; films on until it is known how a, c drift");
}

}  // namespace
}  // namespace emberlock::smear
