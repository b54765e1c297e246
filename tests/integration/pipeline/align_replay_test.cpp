// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/align/json.h"
#include "rig/align/record.h"
#include "session/reader.h"
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

  /// Changes the recorded events, whose length must stay.
  void edit_events(const std::function<void(std::string&)>& edit) const {
    const fs::path events = folder_ / "events.binpb";
    std::string bytes;
    {
      std::ifstream in(events, std::ios::binary);
      bytes.assign(std::istreambuf_iterator<char>(in), {});
    }
    edit(bytes);
    std::ofstream(events, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
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
  std::vector<std::string> live;
  const auto recorded = rig::record_align(folder_, bench.align, bench.options, into(live));
  ASSERT_TRUE(recorded.ok()) << recorded.error().message();
  ASSERT_GT(recorded->resets, 0);

  std::vector<std::string> again;
  std::uint64_t seed = 0;
  const auto replayed = rig::replay_align(folder_, into(again), {}, &seed);
  ASSERT_TRUE(replayed.ok()) << replayed.error().message();
  EXPECT_EQ(live, again);
  EXPECT_EQ(rig::summary_json(*recorded, bench.options.seed).dump(),
            rig::summary_json(*replayed, seed).dump());
}

// From before the strobe was moved and before runs were held: the settings have neither.
TEST_F(AlignReplay, TheFirstRecordingsReplay) {
  SmallBench bench(small_rig(4));
  bench.options.align.strobe_step = Seconds(0);
  std::vector<std::string> live;
  ASSERT_TRUE(rig::record_align(folder_, bench.align, bench.options, into(live)).ok());
  edit_events([](std::string& bytes) {
    for (const std::string setting : {R"("strobe_step_s":0.0,)", R"("hold_s":null,)"}) {
      const auto at = bytes.find(setting);
      ASSERT_NE(at, std::string::npos) << setting;
      bytes.replace(at, setting.size(), setting.size(), ' ');
    }
  });
  std::vector<std::string> again;
  const auto replayed = rig::replay_align(folder_, into(again));
  ASSERT_TRUE(replayed.ok()) << replayed.error().message();
  EXPECT_EQ(live, again);
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
  // One digit of a recorded decision, changed in place.
  edit_events([](std::string& bytes) {
    const auto at = bytes.find("\"beat_ppm\":");
    ASSERT_NE(at, std::string::npos);
    char& digit = bytes[at + 13];
    digit = digit == '3' ? '4' : '3';
  });
  const auto replayed = rig::replay_align(folder_);
  ASSERT_FALSE(replayed.ok());
  EXPECT_THAT(replayed.error().message(), HasSubstr("round 1"));
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
