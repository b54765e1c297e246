// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/align/json.h"
#include "rig/align/record.h"
#include "rig/align/stagger.h"
#include "session/reader.h"
#include "tests/support/dial_bench.h"
#include "tests/support/old_alignment.h"
#include "tests/support/small_rig.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using test::small_rig;
using test::SmallBench;
using testing::HasSubstr;

class AlignReplay : public testing::Test {
 protected:
  AlignReplay()
      : folder_(fs::path(testing::TempDir()) /
                (std::string("align_") + testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::remove_all(folder_);
  }
  ~AlignReplay() override { fs::remove_all(folder_); }

  /// Everything of a round that could differ: the line printed, and the readings to the last bit.
  static rig::AlignObserver into(std::vector<std::string>& lines) {
    return [&lines](const rig::AlignRoundReport& report) {
      lines.push_back(rig::round_json(report).dump());
      for (const auto& camera : report.readings) {
        for (const smear::SmearReading& r : camera) {
          char text[120];
          std::snprintf(text, sizeof text, "%d %a %a", static_cast<int>(r.state),
                        r.lamp ? r.lamp->y.value() : 0, r.dots.empty() ? 0 : r.dots.front().y.value());
          lines.emplace_back(text);
        }
      }
    };
  }

  /// Records a run. Returns its rounds, as `emberlock align --json` prints them.
  std::vector<nlohmann::ordered_json> record(SmallBench& bench) const {
    std::vector<nlohmann::ordered_json> rounds;
    const auto recorded = rig::record_align(
        folder_, bench.align, bench.options,
        [&](const rig::AlignRoundReport& report) { rounds.push_back(rig::round_json(report)); });
    EXPECT_TRUE(recorded.ok());
    EXPECT_FALSE(rounds.empty());
    return rounds;
  }
  static std::vector<std::string> lines_of(const std::vector<nlohmann::ordered_json>& rounds) {
    std::vector<std::string> lines;
    for (const nlohmann::ordered_json& round : rounds) lines.push_back(round.dump());
    return lines;
  }
  /// Records a run, and replays it. Returns the recorded one.
  rig::AlignRunResult expect_the_same_again(SmallBench& bench) const {
    std::vector<std::string> live;
    const auto recorded = rig::record_align(folder_, bench.align, bench.options, into(live));
    if (!recorded.ok()) {
      ADD_FAILURE() << recorded.error().message();
      return {};
    }
    std::vector<std::string> again;
    std::uint64_t seed = 0;
    const auto replayed = rig::replay_align(folder_, into(again), {}, &seed);
    EXPECT_TRUE(replayed.ok()) << replayed.error().message();
    EXPECT_EQ(live, again);
    if (replayed.ok()) {
      EXPECT_EQ(rig::summary_json(*recorded, bench.options.seed).dump(),
                rig::summary_json(*replayed, seed).dump());
    }
    return *recorded;
  }
  void expect_differs_in_round_1() const {
    const auto replayed = rig::replay_align(folder_);
    ASSERT_FALSE(replayed.ok());
    EXPECT_THAT(replayed.error().message(), HasSubstr("round 1"));
  }

  fs::path folder_;
};

TEST_F(AlignReplay, GivesTheSameTrimsToTheBit) {
  drivers::VirtualRigOptions setup = small_rig(4, 2);
  for (drivers::VirtualCameraOptions& camera : setup.cameras) {
    camera.trim = FrameRateTrim{PartsPerMillion(500), PartsPerMillion(0.5), milliseconds(80)};
    camera.reset_jitter = milliseconds(1.5);  // ten rows, which leaves trims something to do
  }
  SmallBench bench(setup);
  bench.options.align.policy = smear::AlignPolicy::trimmed;
  bench.options.align.tolerance.amount = Rows(3);
  bench.options.align.trim_time = Seconds(5);
  std::vector<std::string> live;
  const auto recorded = rig::record_align(folder_, bench.align, bench.options, into(live));
  ASSERT_TRUE(recorded.ok()) << recorded.error().message();
  EXPECT_THAT(live, testing::Contains(HasSubstr("\"servo\":\"slewing\"")));
  std::vector<std::string> again;
  const auto replayed = rig::replay_align(folder_, into(again));
  ASSERT_TRUE(replayed.ok()) << replayed.error().message();
  EXPECT_EQ(live, again);
}

TEST_F(AlignReplay, GivesTheSameReadingsAndDecisionsToTheBit) {
  SmallBench bench(small_rig(4));
  bench.options.align.policy = smear::AlignPolicy::timed;
  bench.options.align.tolerance.amount = milliseconds(1.5);
  EXPECT_GT(expect_the_same_again(bench).resets, 0);
}

TEST_F(AlignReplay, GivesTheSameStaggeredRunToTheBit) {
  SmallBench bench(small_rig(5));
  bench.options.align.policy = smear::AlignPolicy::timed;
  bench.options.align.tolerance.amount = milliseconds(1.5);
  bench.options.offsets = rig::stagger(bench.align.cameras).value();
  EXPECT_EQ(expect_the_same_again(bench).last.verdict, smear::AlignVerdict::aligned);
}

TEST_F(AlignReplay, RecordingsWhoseSettingsAndDecisionsAreJsonReplayWhateverTheirSentences) {
  SmallBench bench(small_rig(4));
  bench.options.align.policy = smear::AlignPolicy::timed;
  bench.options.align.limits = smear::AlignLimits{};
  std::vector<nlohmann::ordered_json> rounds = record(bench);
  const std::vector<std::string> live = lines_of(rounds);
  for (nlohmann::ordered_json& round : rounds) {
    round["reason"] = "as it was worded once";
    for (nlohmann::ordered_json& camera : round["cameras"]) camera["reason"] = "another sentence";
  }
  test::write_as_before(folder_, test::old_settings(bench.options), lines_of(rounds));
  std::vector<std::string> again;
  const auto replayed = rig::replay_align(
      folder_, [&](const rig::AlignRoundReport& report) { again.push_back(rig::round_json(report).dump()); });
  ASSERT_TRUE(replayed.ok()) << replayed.error().message();
  EXPECT_EQ(live, again);

  rounds.front()["beat_ppm"] = rounds.front()["beat_ppm"].get<double>() + 1e-9;
  test::write_as_before(folder_, {}, lines_of(rounds));
  expect_differs_in_round_1();
}

TEST_F(AlignReplay, RecordingsWhoseDialHasAdviceInWordsReplay) {
  test::DialBench bench(small_rig(4, 2));
  int rounds_left = 3;
  std::vector<std::string> lines;
  ASSERT_TRUE(rig::record_align(
                  folder_, bench.align, bench.options,
                  [&](const rig::AlignRoundReport& report) {
                    nlohmann::ordered_json round = rig::round_json(report);
                    EXPECT_FALSE(round["dial"]["words"].get<std::string>().empty());
                    round["dial"]["words"] = "turn it somewhere";
                    lines.push_back(round.dump());
                    --rounds_left;
                  },
                  {}, [&] { return rounds_left <= 0; })
                  .ok());
  EXPECT_TRUE(rig::replay_align(folder_).ok());
  test::write_as_before(folder_, test::old_settings(bench.options), lines);
  const auto replayed = rig::replay_align(folder_);
  EXPECT_TRUE(replayed.ok()) << replayed.error().message();
}

// From before the strobe was moved and before runs were held: the settings have neither.
TEST_F(AlignReplay, TheFirstRecordingsReplay) {
  SmallBench bench(small_rig(4));
  bench.options.align.strobe_step = Seconds(0);
  std::vector<std::string> live;
  for (nlohmann::ordered_json round : record(bench)) {
    round.erase("sensor");
    for (nlohmann::ordered_json& camera : round["cameras"]) camera.erase("servo");
    live.push_back(round.dump());
  }
  nlohmann::ordered_json settings = test::old_settings(bench.options);
  for (const char* key : {"strobe_step_s", "hold_s", "reset_by"}) settings.erase(key);
  test::write_as_before(folder_, settings, live);
  const auto replayed = rig::replay_align(folder_);
  EXPECT_TRUE(replayed.ok()) << replayed.error().message();
}

TEST_F(AlignReplay, EveryFrameOfTheRunIsInTheRecording) {
  SmallBench bench(small_rig(4));
  ASSERT_TRUE(rig::record_align(folder_, bench.align, bench.options).ok());
  const auto session = session::SessionReader::open(folder_);
  ASSERT_TRUE(session.ok());
  for (const v1::CameraStream& camera : session->manifest().cameras()) {
    EXPECT_GT(camera.counts().recorded(), 12u);
    EXPECT_EQ(camera.counts().transport() + camera.counts().queue() + camera.counts().disk(), 0u);
  }
}

TEST_F(AlignReplay, ADecisionThatDiffersFromTheRecordedOneIsAnError) {
  SmallBench bench(small_rig(4));
  ASSERT_TRUE(rig::record_align(folder_, bench.align, bench.options).ok());
  const std::vector<v1::Event> events = test::events_of(folder_);
  const auto edit_first = [&](const std::function<void(v1::DecisionEvent&)>& edit) {
    std::vector<v1::Event> edited = events;
    const auto first = std::find_if(edited.begin(), edited.end(),
                                    [](const v1::Event& event) { return event.has_decision(); });
    ASSERT_NE(first, edited.end());
    EXPECT_TRUE(first->decision().json().empty());
    edit(*first->mutable_decision());
    test::write_events(folder_, edited);
  };
  edit_first([](v1::DecisionEvent& decision) {
    decision.set_period_offset_ppm(std::nextafter(decision.period_offset_ppm(), 1e9));
  });
  expect_differs_in_round_1();
  edit_first([](v1::DecisionEvent& decision) {
    decision.mutable_cameras(1)->mutable_reason()->set_cause(v1::DecisionEvent::CameraReason::AWAY);
  });
  expect_differs_in_round_1();
  edit_first([](v1::DecisionEvent&) {});
  EXPECT_TRUE(rig::replay_align(folder_).ok());
}

TEST_F(AlignReplay, ASessionOfAnythingElseIsRefused) {
  v1::Manifest manifest;
  manifest.set_purpose("flame");
  SmallBench bench(small_rig(1, 1));
  auto& camera = *manifest.add_cameras();
  camera.set_camera_id("a");
  camera.set_format(v1::CameraStream::GRAY8);
  camera.set_width(320);
  camera.set_height(240);
  camera.set_bit_depth(8);
  camera.set_frame_rate_hz(23.976);
  auto writer = session::SessionWriter::create(folder_, manifest);
  ASSERT_TRUE(writer.ok()) << writer.error().message();
  ASSERT_TRUE(writer->finish().ok());
  const auto replayed = rig::replay_align(folder_);
  ASSERT_FALSE(replayed.ok());
  EXPECT_EQ(replayed.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(replayed.error().message(), HasSubstr("emberlock align --record"));
}

}  // namespace
}  // namespace emberlock::cli
