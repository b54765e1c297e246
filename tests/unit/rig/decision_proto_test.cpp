// SPDX-License-Identifier: Apache-2.0
// What is recorded of a round: codes and numbers, all of them, and no sentence.
#include "rig/align/decision_proto.h"

#include <functional>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace emberlock::rig {
namespace {

/// A round with something of everything.
struct Recorded {
  Recorded() {
    round.period_offset = {PartsPerMillion(167), PartsPerMillion(5)};
    round.cameras.resize(2);
    round.cameras[0].phase = {smear::PhaseState::known, milliseconds(16), microseconds(3), {}};
    decision.cameras.resize(2);
    decision.dial.emplace();
    words.cameras.resize(2);
  }
  [[nodiscard]] std::string bytes() const {
    return to_proto({round, decision, words, cameras, sensors, options, strobe, {}, {}}).SerializeAsString();
  }

  smear::AlignRound round;
  smear::AlignDecision decision;
  smear::AlignWords words;
  std::vector<smear::AlignCamera> cameras{{.id = "a", .model = "m", .expected_delay = {}},
                                          {.id = "b", .model = "m", .expected_delay = {}}};
  std::vector<SensorKind> sensors{SensorKind::ccd, SensorKind::ccd};
  smear::AlignOptions options;
  drivers::StrobeSettings strobe;
};

TEST(DecisionProto, NoSentenceHasAPlaceInIt) {
  std::set<const google::protobuf::Descriptor*> seen;
  std::vector<std::string> texts;
  const std::function<void(const google::protobuf::Descriptor*)> look =
      [&](const google::protobuf::Descriptor* type) {
        if (!seen.insert(type).second) return;
        for (int i = 0; i < type->field_count(); ++i) {
          const auto* field = type->field(i);
          if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_STRING)
            texts.push_back(field->full_name());
          if (field->message_type() != nullptr) look(field->message_type());
        }
      };
  look(v1::DecisionEvent::descriptor());
  EXPECT_EQ(texts, std::vector<std::string>{"emberlock.v1.DecisionEvent.json"});
  EXPECT_GT(seen.size(), 8U);
}

TEST(DecisionProto, AnotherWordingIsRecordedAlike) {
  Recorded once;
  Recorded reworded;
  reworded.words = {"a verdict", "a remedy", {"to the one", "to the other"}, "turn it"};
  reworded.round.cameras[1].phase.reason = "no lamp in view";
  EXPECT_EQ(once.bytes(), reworded.bytes());
  EXPECT_EQ(to_proto({once.round,
                      once.decision,
                      once.words,
                      once.cameras,
                      once.sensors,
                      once.options,
                      once.strobe,
                      {},
                      {}})
                .json(),
            "");
}

TEST(DecisionProto, EveryNumberIsRecorded) {
  using smear::AlignDecision;
  const std::vector<std::function<void(AlignDecision&)>> changes{
      [](AlignDecision& d) { d.round = 3; },
      [](AlignDecision& d) { d.target = Seconds(0); },
      [](AlignDecision& d) { d.target = milliseconds(1); },
      [](AlignDecision& d) { d.reference = 0; },
      [](AlignDecision& d) { d.reference = 1; },
      [](AlignDecision& d) { d.worst_pair = Seconds(0); },
      [](AlignDecision& d) { d.strobe_phase = milliseconds(2); },
      [](AlignDecision& d) { d.resets_so_far = 4; },
      [](AlignDecision& d) { d.renews = true; },
      [](AlignDecision& d) { d.in_time = true; },
      [](AlignDecision& d) { d.reset_next = 1; },
      [](AlignDecision& d) { d.jumped = {1}; },
      [](AlignDecision& d) { d.next_check = Seconds(9); },
      [](AlignDecision& d) { d.effort = smear::AlignEffort{}; },
      [](AlignDecision& d) { d.effort.emplace().resets = 1; },
      [](AlignDecision& d) { d.effort.emplace().resets_p95 = 2; },
      [](AlignDecision& d) { d.effort.emplace().time = Seconds(1); },
      [](AlignDecision& d) { d.effort.emplace().time_p95 = Seconds(1); },
      [](AlignDecision& d) { d.effort.emplace().within = 0.5; },
      [](AlignDecision& d) {
        d.offers = {{smear::AlignPolicy::timed, {Rows(3)}, {}}};
      },
      [](AlignDecision& d) {
        d.offers = {{smear::AlignPolicy::timed, {Seconds(3)}, {}}};
      },
      [](AlignDecision& d) {
        d.offers = {{smear::AlignPolicy::densest, {Rows(3)}, {}}};
      },
      [](AlignDecision& d) { d.reason.cameras = {1}; },
      [](AlignDecision& d) { d.reason.unmoved = {1}; },
      [](AlignDecision& d) { d.reason.rough = {1}; },
      [](AlignDecision& d) { d.reason.sigma = Seconds(1); },
      [](AlignDecision& d) { d.reason.looks = 1; },
      [](AlignDecision& d) { d.reason.rounds = 1; },
      [](AlignDecision& d) { d.reason.first_out = 0; },
      [](AlignDecision& d) { d.cameras[1].error = Seconds(0); },
      [](AlignDecision& d) { d.cameras[0].error = Seconds(0); },
      [](AlignDecision& d) { d.cameras[1].sigma = Seconds(1); },
      [](AlignDecision& d) { d.cameras[1].reset = true; },
      [](AlignDecision& d) { d.cameras[1].moment = TimePoint{}; },
      [](AlignDecision& d) { d.cameras[1].moment = TimePoint{1}; },
      [](AlignDecision& d) { d.cameras[1].trim = PartsPerMillion(0); },
      [](AlignDecision& d) { d.cameras[1].time_left = smear::TimeLeft{}; },
      [](AlignDecision& d) { d.cameras[1].time_left.emplace().expected = Seconds(1); },
      [](AlignDecision& d) { d.cameras[1].time_left.emplace().earliest = Seconds(1); },
      [](AlignDecision& d) { d.cameras[1].time_left.emplace().latest = Seconds(1); },
      [](AlignDecision& d) { d.cameras[1].reason.stay = Seconds(1); },
      [](AlignDecision& d) { d.cameras[1].reason.trim = PartsPerMillion(1); },
      [](AlignDecision& d) { d.cameras[1].reason.after = 0; },
      [](AlignDecision& d) { d.cameras[1].reason.doubt = smear::Doubt{}; },
      [](AlignDecision& d) { d.cameras[1].reason.doubt = smear::Doubt{.strobe = Seconds(1)}; },
      [](AlignDecision& d) { d.cameras[1].reason.doubt = smear::Doubt{.seen = Seconds(1)}; },
      [](AlignDecision& d) { d.dial.reset(); },
      [](AlignDecision& d) { d.dial->set = Hertz(1); },
      [](AlignDecision& d) { d.dial->measured = Hertz(0); },
      [](AlignDecision& d) { d.dial->sigma = PartsPerMillion(1); },
      [](AlignDecision& d) { d.dial->others = {Hertz(1)}; },
      [](AlignDecision& d) { d.dial->ready = true; },
      [](AlignDecision& d) { d.dial->act = true; },
      [](AlignDecision& d) { d.dial->slower_than = Hertz(1); },
      [](AlignDecision& d) { d.dial->from = Hertz(1); },
      [](AlignDecision& d) { d.dial->hidden = {1}; }};
  std::set<std::string> all{Recorded().bytes()};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    Recorded changed;
    changes[i](changed.decision);
    EXPECT_TRUE(all.insert(changed.bytes()).second) << i;
  }
}

TEST(DecisionProto, WhatWasReadIsRecorded) {
  std::set<std::string> all{Recorded().bytes()};
  const auto expect_new = [&](const std::function<void(Recorded&)>& change) {
    Recorded changed;
    change(changed);
    EXPECT_TRUE(all.insert(changed.bytes()).second);
  };
  expect_new([](Recorded& r) { r.round.period_offset.rate = PartsPerMillion(168); });
  expect_new([](Recorded& r) { r.round.period_offset.sigma = PartsPerMillion(6); });
  expect_new([](Recorded& r) { r.round.cameras[0].phase.tau = milliseconds(17); });
  expect_new([](Recorded& r) { r.round.cameras[0].phase.sigma = microseconds(4); });
  expect_new([](Recorded& r) { r.round.cameras[0].phase.state = smear::PhaseState::blind; });
  expect_new([](Recorded& r) { r.strobe.phase = milliseconds(1); });
}

/// How many different recordings the codes from `first` to `last` make, `set` in a decision.
template <class Code>
std::size_t recordings_of(Code first, Code last,
                          const std::function<void(smear::AlignDecision&, Code)>& set) {
  std::set<std::string> all;
  for (int code = static_cast<int>(first); code <= static_cast<int>(last); ++code) {
    Recorded one;
    set(one.decision, static_cast<Code>(code));
    all.insert(one.bytes());
  }
  return all.size();
}

TEST(DecisionProto, EveryCodeHasANumberOfItsOwn) {
  using smear::AlignDecision;
  EXPECT_EQ(recordings_of<smear::AlignVerdict>(smear::AlignVerdict::go_on, smear::AlignVerdict::given_up,
                                               [](AlignDecision& d, auto code) { d.verdict = code; }),
            4U);
  EXPECT_EQ(recordings_of<smear::AlignGoal>(smear::AlignGoal::tolerance, smear::AlignGoal::reach,
                                            [](AlignDecision& d, auto code) { d.goal = code; }),
            2U);
  EXPECT_EQ(recordings_of<smear::AlignCause>(smear::AlignCause::none, smear::AlignCause::dial,
                                             [](AlignDecision& d, auto code) { d.reason.cause = code; }),
            16U);
  EXPECT_EQ(recordings_of<smear::CameraCause>(
                smear::CameraCause::none, smear::CameraCause::waits_for_dial,
                [](AlignDecision& d, auto code) { d.cameras[1].reason.cause = code; }),
            23U);
  EXPECT_EQ(recordings_of<smear::ResetTiming>(
                smear::ResetTiming::none, smear::ResetTiming::teaches,
                [](AlignDecision& d, auto code) { d.cameras[1].reason.timing = code; }),
            4U);
  EXPECT_EQ(recordings_of<smear::DoubtCause>(
                smear::DoubtCause::strobe_stood, smear::DoubtCause::stood_in_walk,
                [](AlignDecision& d, auto code) { d.cameras[1].reason.doubt = smear::Doubt{code}; }),
            7U);
  EXPECT_EQ(recordings_of<smear::PhaseState>(smear::PhaseState::known, smear::PhaseState::unusable,
                                             [](AlignDecision& d, auto code) { d.cameras[1].state = code; }),
            3U);
  EXPECT_EQ(recordings_of<smear::ServoState>(smear::ServoState::slewing, smear::ServoState::locked,
                                             [](AlignDecision& d, auto code) { d.cameras[1].servo = code; }),
            3U);
  EXPECT_EQ(recordings_of<smear::DialCause>(smear::DialCause::leave, smear::DialCause::turn_off_rate,
                                            [](AlignDecision& d, auto code) { d.dial->cause = code; }),
            4U);
  EXPECT_EQ(recordings_of<smear::FlashesSeen>(smear::FlashesSeen::rate, smear::FlashesSeen::none,
                                              [](AlignDecision& d, auto code) { d.dial->seen = code; }),
            6U);
}

}  // namespace
}  // namespace emberlock::rig
