// SPDX-License-Identifier: Apache-2.0
// Volumes of a recording while it goes on: the engine with simulated cameras before a flame, and the program
// that reconstructs.
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>

#include <gmock/gmock.h>
#include <unistd.h>

#include "daemon/engine/engine.h"
#include "session/reader.h"
#include "tests/support/recording.h"
#include "tests/support/wait.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;
using Live = v1::LiveStatus;

class LiveVolumesProgramTestSlow : public testing::Test {
 protected:
  LiveVolumesProgramTestSlow() {
    config_.rig.name = "small";
    rig::CameraConfig cameras;
    cameras.count = 4;
    cameras.request.size = ImageSize{160, 120};
    config_.rig.cameras.push_back(cameras);
    config_.rig.virtual_rig.time = rig::VirtualConfig::Time::real;
    config_.rig.virtual_rig.scene = rig::VirtualConfig::Scene::flame;
    config_.recording.folder = temp_ / "sessions";
    config_.recording.writer = test::small_disk_options(session::Encoding::raw_nut);
    config_.recording.transcode = rig::RecordingConfig::Transcode::never;
    config_.reconstruction.program = EMBERLOCK_PROGRAM;
    config_.reconstruction.device = "cpu";
  }
  void start() {
    auto engine = daemon::Engine::start(config_, board_);
    ASSERT_TRUE(engine.ok()) << engine.error().message();
    engine_ = std::move(*engine);
    ASSERT_TRUE(test::wait_until([&] { return board_.status()->phase() == v1::IDLE; }));
  }
  static v1::RecordRequest take(const std::string& name, std::optional<v1::LiveRequest> live) {
    v1::RecordRequest request;
    request.set_name(name);
    request.set_unlocked(true);
    if (live) *request.mutable_live() = *live;
    return request;
  }
  static v1::LiveRequest live(std::uint32_t every = 0, std::uint32_t voxels = 0) {
    v1::LiveRequest request;
    request.set_every(every);
    request.set_voxels(voxels);
    return request;
  }
  [[nodiscard]] Live status() const { return board_.status()->live(); }
  bool until(const std::function<bool(const Live&)>& condition) {
    return test::wait_until([&] { return condition(status()); });
  }
  /// Records with live volumes until that holds, and goes on recording. Where the machine is so busy that
  /// they give way for good, again.
  void record_until(const v1::LiveRequest& request, const std::function<bool(const Live&)>& condition) {
    constexpr int kTries = 8;
    for (int i = 0; i < kTries; ++i) {
      const auto begun = engine_->record(take("take " + std::to_string(i), request));
      ASSERT_TRUE(begun.ok()) << begun.error().message();
      ASSERT_TRUE(until([&](const Live& now) {
        return now.session() == begun->session() && (condition(now) || now.state() == Live::STOPPED);
      })) << status().ShortDebugString();
      if (status().state() != Live::STOPPED) return;
      stop_recording();
    }
    FAIL() << status().ShortDebugString();
  }
  v1::RecordingStatus stop_recording() {
    const auto recorded = engine_->stop_recording();
    if (!recorded.ok()) {
      ADD_FAILURE() << recorded.error().message();
      return {};
    }
    expect_whole(*recorded);
    return *recorded;
  }
  /// Of ours, the process that makes volumes; 0: there is none.
  static pid_t child() {
    for (const auto& entry : fs::directory_iterator("/proc")) {
      const int pid = std::atoi(entry.path().filename().c_str());
      if (pid <= 0) continue;
      std::ifstream in(entry.path() / "cmdline");
      const std::string command((std::istreambuf_iterator<char>(in)), {});
      std::ifstream stat(entry.path() / "stat");
      std::string text;
      std::getline(stat, text);
      const auto bracket = text.rfind(") ");
      if (bracket == std::string::npos || command.find("reconstruct-live") == std::string::npos) continue;
      if (std::atoi(text.c_str() + bracket + 4) == ::getpid()) return pid;
    }
    return 0;
  }
  /// The recording's books agree, and volumes cost it nothing: they have ended where a frame was lost.
  void expect_whole(const v1::RecordingStatus& recording) const {
    EXPECT_EQ(recording.state(), v1::RecordingStatus::COMPLETE) << recording.verdict();
    const v1::Counts& lost = recording.lost();
    if (status().session() == recording.session() && lost.queue() + lost.disk() > 0) {
      EXPECT_NE(status().state(), Live::ENDED) << "they have ended before: " << recording.verdict();
    }
    auto reader = session::SessionReader::open(temp_ / ("sessions/" + recording.session()));
    ASSERT_TRUE(reader.ok()) << reader.error().message();
    EXPECT_GT(recording.frames(), 0U);
    std::uint64_t frames = 0;
    for (std::size_t i = 0; i < reader->camera_count(); ++i) frames += reader->stamps(i).size();
    EXPECT_EQ(frames, recording.frames());
  }

  test::TempFolder temp_;
  rig::DaemonConfig config_;
  daemon::Board board_;
  std::unique_ptr<daemon::Engine> engine_;
};

TEST_F(LiveVolumesProgramTestSlow, VolumesComeWhileItIsRecordedAndCostItNothing) {
  start();
  ASSERT_TRUE(engine_->record(take("without", {})).ok());
  ASSERT_TRUE(test::wait_until([&] { return board_.status()->recording().frames() > 60; }));
  EXPECT_FALSE(board_.status()->has_live());
  stop_recording();

  record_until(live(), [](const Live& now) { return now.volumes() >= 3 && now.keeps_up(); });
  EXPECT_EQ(board_.status()->phase(), v1::CAPTURING) << "while it is recorded";
  const Live running = status();
  EXPECT_GT(running.delay_s(), 0);
  EXPECT_GT(running.takes_s(), 0);
  EXPECT_EQ(running.device(), "cpu");
  const auto shown = board_.iterations(0);
  ASSERT_EQ(shown.size(), 1U) << "the newest alone";
  EXPECT_EQ(shown.back()->reconstruction(), running.session() + " live");
  EXPECT_GT(shown.back()->volume().brightest(), 0);
  v1::ReconstructRequest request;
  request.set_session("without");
  const auto refused = engine_->reconstruct(request);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message(), HasSubstr("live volumes have the machine"));
  const v1::RecordingStatus with = stop_recording();
  EXPECT_TRUE(status().state() == Live::ENDED || status().state() == Live::STOPPED);
  EXPECT_LT(status().frame(), with.frames());
  EXPECT_TRUE(test::wait_until([] { return child() == 0; })) << "the process is gone";
}

TEST_F(LiveVolumesProgramTestSlow, OneThatCannotKeepUpIsOvertakenAndSaysWhatWouldHold) {
  start();
  record_until(live(1, 64),
               [](const Live& now) { return now.volumes() >= 2 && !now.keeps_up() && now.skipped() > 0; });
  const Live slow = status();
  EXPECT_EQ(slow.voxels(), 64U);
  EXPECT_GT(slow.holds_every(), 1U);
  if (slow.state() == Live::RUNNING) {
    EXPECT_THAT(slow.reason(), HasSubstr("--every"));
  }
  stop_recording();
}

TEST_F(LiveVolumesProgramTestSlow, AChildThatIsKilledIsToldAndTheRecordingGoesOn) {
  start();
  pid_t pid = 0;
  record_until(live(2, 16), [&](const Live& now) { return now.volumes() >= 1 && (pid = child()) > 0; });
  ASSERT_EQ(::kill(pid, SIGKILL), 0);
  ASSERT_TRUE(until([](const Live& now) { return now.state() == Live::FAILED; }));
  EXPECT_THAT(status().reason(), HasSubstr("was killed"));
  const std::uint64_t then = board_.status()->recording().frames();
  ASSERT_TRUE(test::wait_until([&] { return board_.status()->recording().frames() > then + 40; }));
  EXPECT_EQ(board_.status()->phase(), v1::CAPTURING);
  stop_recording();
}

TEST_F(LiveVolumesProgramTestSlow, WithoutACalibrationOrOutOfRangeNothingBegins) {
  config_.rig.virtual_rig.scene = rig::VirtualConfig::Scene::dark_room;
  start();
  const auto refused = engine_->record(take("take", live()));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(refused.error().message(), HasSubstr("isn't calibrated"));
  EXPECT_THAT(refused.error().message(), HasSubstr("emberlock calibrate cameras"));
  const auto voxels = engine_->record(take("take", live(0, 5000)));
  ASSERT_FALSE(voxels.ok());
  EXPECT_THAT(voxels.error().message(), HasSubstr("live.voxels"));
  EXPECT_FALSE(fs::exists(temp_ / "sessions/take"));
  EXPECT_TRUE(engine_->record(take("take", {})).ok()) << "without them it is recorded";
  EXPECT_TRUE(engine_->stop_recording().ok());
}

}  // namespace
}  // namespace emberlock
