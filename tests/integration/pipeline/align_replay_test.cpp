// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "rig/align/json.h"
#include "rig/align/record.h"
#include "rig/align/stagger.h"
#include "session/reader.h"
#include "tests/support/dial_bench.h"
#include "tests/support/small_rig.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using test::small_rig;
using test::SmallBench;
using testing::HasSubstr;

std::vector<v1::Event> events_of(const fs::path& folder) {
  const auto session = session::SessionReader::open(folder);
  EXPECT_TRUE(session.ok());
  return session.ok() ? session->events() : std::vector<v1::Event>();
}

void write_events(const fs::path& folder, const std::vector<v1::Event>& events) {
  std::ofstream out(folder / "events.binpb", std::ios::binary | std::ios::trunc);
  for (const v1::Event& event : events)
    ASSERT_TRUE(google::protobuf::util::SerializeDelimitedToOstream(event, &out));
}

/// A rig whose recordings are small: two cameras with few columns and next to no noise.
drivers::VirtualRigOptions quiet_rig() {
  drivers::VirtualRigOptions rig = small_rig(4, 2);
  for (drivers::VirtualCameraOptions& camera : rig.cameras) {
    camera.layout.size.width = 32;
    camera.lamp.x = 16;
  }
  rig.scene.read_noise = 0.1;
  rig.scene.electrons_per_level = 1e6;
  return rig;
}

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

  /// Keeps the recording for later versions (tests/files/session_VERSION/README.md).
  void keep_as(const char* name) const {
    const char* kept = std::getenv("EMBERLOCK_KEEP_RECORDINGS");  // NOLINT(concurrency-mt-unsafe)
    if (kept != nullptr) fs::copy(folder_, fs::path(kept) / name, fs::copy_options::recursive);
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

TEST_F(AlignReplay, ATimedRunOfASmallRigIsTheSameAgain) {
  SmallBench bench(quiet_rig());
  bench.options.align.policy = smear::AlignPolicy::timed;
  EXPECT_GT(expect_the_same_again(bench).resets, 0);
  keep_as("timed");
}

TEST_F(AlignReplay, ATrimmedRunOfASmallRigIsTheSameAgain) {
  drivers::VirtualRigOptions setup = quiet_rig();
  for (drivers::VirtualCameraOptions& camera : setup.cameras) {
    camera.trim = FrameRateTrim{PartsPerMillion(500), PartsPerMillion(0.5), milliseconds(80)};
    camera.reset_jitter = milliseconds(1.5);
  }
  SmallBench bench(setup);
  bench.options.align.policy = smear::AlignPolicy::trimmed;
  bench.options.align.tolerance.amount = Rows(3);
  bench.options.align.trim_time = Seconds(5);
  EXPECT_EQ(expect_the_same_again(bench).last.verdict, smear::AlignVerdict::aligned);
  keep_as("trimmed");
}

TEST_F(AlignReplay, ARunWithADialIsTheSameAgain) {
  test::DialBench bench(quiet_rig());
  int rounds = 0;
  std::vector<std::string> live;
  const auto note = into(live);
  const auto obey = [&](const rig::AlignRoundReport& report) {
    ++rounds;
    note(report);
    ASSERT_TRUE(report.decision.dial);
    bench.obey(*report.decision.dial);
  };
  ASSERT_TRUE(
      rig::record_align(folder_, bench.align, bench.options, obey, {}, [&] { return rounds >= 4; }).ok());
  EXPECT_GT(bench.turns, 0);
  std::vector<std::string> again;
  const auto replayed = rig::replay_align(folder_, into(again));
  ASSERT_TRUE(replayed.ok()) << replayed.error().message();
  EXPECT_EQ(live, again);
  keep_as("dial");
}

TEST_F(AlignReplay, RecordingsOfEarlierVersionsReplay) {
  const auto replayed = rig::replay_align(EMBERLOCK_SOURCE_DIR "/tests/files/session_0.2.0/alignment/timed");
  ASSERT_TRUE(replayed.ok()) << replayed.error().message();
  EXPECT_EQ(replayed->last.verdict, smear::AlignVerdict::aligned);
}

TEST_F(AlignReplay, NotesInFrontOfTheSettingsChangeNothing) {
  SmallBench bench(quiet_rig());
  ASSERT_TRUE(rig::record_align(folder_, bench.align, bench.options).ok());
  std::vector<v1::Event> events = events_of(folder_);
  for (const char* text : {"late frame: 3 0.5 a", "{\"aligned\": 1}", "[\"align\"]"}) {
    v1::Event note;
    note.set_note(text);
    events.insert(events.begin(), note);
  }
  write_events(folder_, events);
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
  const std::vector<v1::Event> events = events_of(folder_);
  const auto edit_first = [&](const std::function<void(v1::DecisionEvent&)>& edit) {
    std::vector<v1::Event> edited = events;
    const auto first = std::find_if(edited.begin(), edited.end(),
                                    [](const v1::Event& event) { return event.has_decision(); });
    ASSERT_NE(first, edited.end());
    edit(*first->mutable_decision());
    write_events(folder_, edited);
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
