// SPDX-License-Identifier: Apache-2.0
// What goes wrong in a lab: each time the operator is told what happened and what to do, and what was
// recorded stays.
#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <thread>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/unique_fd.h"
#include "session/reader.h"
#include "session/verify.h"
#include "tests/support/small_daemon.h"
#include "tests/support/socket_cameras.h"
#include "tests/support/wait.h"

namespace emberlock {
namespace {

using test::SmallDaemon;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::Ge;
using ::testing::HasSubstr;
using ::testing::Le;
using ::testing::SizeIs;

class Faults : public ::testing::Test {
 protected:
  Faults() {
    for (const char* id : {"left", "right"}) {
      test::plug_in(id);
      test::ail(id, test::Ails::nothing);
    }
  }
  ~Faults() override {
    for (const char* id : {"left", "right"}) test::ail(id, test::Ails::nothing);
  }

  /// Two cameras that film in real time.
  rig::DaemonConfig config() {
    rig::DaemonConfig config = test::small_config(temp_.path());
    config.rig.cameras.clear();
    for (const char* id : {"left", "right"}) {
      rig::CameraConfig camera;
      camera.source = rig::CameraSource::v4l2;
      camera.id = id;
      config.rig.cameras.push_back(camera);
    }
    config.rig.virtual_rig.time = rig::VirtualConfig::Time::real;
    config.rig.strobe.source = rig::StrobeSource::none;
    return config;
  }
  rig::RigOptions options() {
    rig::RigOptions options;
    options.drivers = drivers_;
    return options;
  }
  /// Works in real time.
  static bool soon(SmallDaemon& daemon, const std::function<bool()>& holds) {
    return test::wait_until([&] {
      daemon.conductor->work();
      return holds();
    });
  }
  /// Until so many more frames have been recorded.
  static bool films_on(SmallDaemon& daemon, std::uint64_t frames) {
    const auto arrived = [&] { return daemon.conductor->status().recording().progress().arrived(); };
    return soon(daemon, [&, from = arrived()] { return arrived() > from + frames; });
  }
  static std::function<bool()> all_film(SmallDaemon& daemon) {
    return [&daemon] {
      const v1::DaemonStatus status = daemon.conductor->status();
      return std::all_of(
          status.cameras().begin(), status.cameras().end(), [](const v1::CameraStatus& camera) {
            return camera.state() == v1::CameraStatus::FILMING && camera.counts().delivered() > 0;
          });
    };
  }
  /// What the journal says of a camera.
  static std::vector<std::string> journal_of(SmallDaemon& daemon, const std::string& id) {
    std::vector<std::string> lines;
    for (const v1::Notice& notice : daemon.board.notices(0))
      if (notice.text().find(id) != std::string::npos) lines.push_back(notice.text());
    return lines;
  }
  /// Many more slices than it takes to tell anything.
  static void go_round(SmallDaemon& daemon) {
    for (int i = 0; i < 2000; ++i) daemon.conductor->work();
  }
  session::SessionReader take() {
    return session::SessionReader::open(temp_.path() / "sessions" / "take").value();
  }

  test::TempFolder temp_;
  std::vector<drivers::CameraDriver> drivers_ = test::socket_drivers();
};

TEST_F(Faults, ACameraThatGoesAndComesBackIsToldAndTheOthersLoseNothing) {
  SmallDaemon daemon(config(), options());
  ASSERT_TRUE(soon(daemon, all_film(daemon)));
  ASSERT_TRUE(daemon.record("take").ok());
  ASSERT_TRUE(films_on(daemon, 60));
  test::unplug("left");
  ASSERT_TRUE(soon(daemon, [&] { return daemon.fault(v1::Fault::CAMERA_LOST) != nullptr; }));
  EXPECT_EQ(daemon.fault(v1::Fault::CAMERA_LOST)->subject(), "left");
  EXPECT_FALSE(daemon.fault(v1::Fault::CAMERA_LOST)->remedy().empty());
  EXPECT_EQ(daemon.status.light(), v1::RED);
  EXPECT_THAT(daemon.status.next_step(), HasSubstr("left"));
  EXPECT_EQ(daemon.conductor->phase(), v1::CAPTURING);
  test::plug_in("left");
  ASSERT_TRUE(soon(daemon, [&] { return daemon.fault(v1::Fault::CAMERA_LOST)->over(); }));
  ASSERT_TRUE(daemon.conductor->stop_recording().ok());
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->phase() == v1::IDLE; }));
  EXPECT_EQ(daemon.conductor->status().recording().state(), v1::RecordingStatus::COMPLETE)
      << daemon.conductor->status().recording().verdict();
  session::SessionReader session = take();
  const auto& stamps = session.stamps(1);
  ASSERT_GT(stamps.size(), 20U);
  for (std::size_t i = 1; i < stamps.size(); ++i) EXPECT_EQ(stamps[i].frame_id, stamps[i - 1].frame_id + 1);
  EXPECT_GT(session.stamps(0).size(), 10U);
}

TEST_F(Faults, AllCamerasLostIsOneFaultMoreAndWhatWasRecordedStays) {
  SmallDaemon daemon(config(), options());
  ASSERT_TRUE(soon(daemon, all_film(daemon)));
  ASSERT_TRUE(daemon.record("take").ok());
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->status().recording().frames() > 40; }));
  test::unplug("left");
  test::unplug("right");
  ASSERT_TRUE(soon(daemon, [&] { return daemon.fault(v1::Fault::ALL_CAMERAS_LOST) != nullptr; }));
  ASSERT_TRUE(daemon.conductor->stop_recording().ok());
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->phase() == v1::IDLE; }));
  EXPECT_GE(daemon.conductor->status().recording().frames(), 40U);
  EXPECT_TRUE(session::verify_session(temp_.path() / "sessions" / "take")->whole());
}

TEST_F(Faults, BelowTheFloorOfFreeSpaceNoRecordingBeginsAndNoFolderStays) {
  rig::DaemonConfig full = config();
  full.recording.writer.min_free_bytes = std::uint64_t{1} << 60;
  SmallDaemon daemon(full, options());
  ASSERT_TRUE(soon(daemon, all_film(daemon)));
  const auto refused = daemon.record("take");
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message(), HasSubstr("floor"));
  EXPECT_THAT(refused.error().message(), HasSubstr("Free space"));
  EXPECT_EQ(daemon.conductor->phase(), v1::IDLE);
  EXPECT_FALSE(std::filesystem::exists(temp_.path() / "sessions" / "take"));
}

TEST_F(Faults, ASilentStrobeIsWaitedForAndSaidSo) {
  rig::DaemonConfig silent = config();
  silent.rig.strobe.source = rig::StrobeSource::serial;
  silent.rig.strobe.id = "nobody";
  SmallDaemon daemon(silent, options());
  ASSERT_NE(daemon.fault(v1::Fault::STROBE_SILENT), nullptr);
  ASSERT_TRUE(daemon.conductor->align({}).ok());
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->status().reason() == "waiting for the strobe"; }));
  EXPECT_EQ(daemon.conductor->phase(), v1::CALIBRATING);
  EXPECT_EQ(daemon.conductor->status().light(), v1::RED);
  EXPECT_FALSE(daemon.conductor->status().next_step().empty());
  ASSERT_TRUE(daemon.conductor->stop_sync().ok());
  EXPECT_EQ(daemon.conductor->phase(), v1::IDLE);
}

TEST_F(Faults, ACameraThatIsAbsentAtStartIsTakenUpWhenItComes) {
  test::unplug("right");
  SmallDaemon daemon(config(), options());
  ASSERT_TRUE(soon(daemon, [&] { return daemon.fault(v1::Fault::CAMERA_LOST) != nullptr; }));
  test::plug_in("right");
  ASSERT_TRUE(soon(daemon, all_film(daemon)));
  EXPECT_TRUE(daemon.fault(v1::Fault::CAMERA_LOST)->over());
}

TEST_F(Faults, AReplayThatEndsIsToldOnceAndNoRecordingBeginsAfterIt) {
  SmallDaemon daemon(config(), options());
  ASSERT_TRUE(soon(daemon, all_film(daemon)));
  test::ail("left", test::Ails::ended);
  test::ail("right", test::Ails::ended);
  ASSERT_TRUE(soon(daemon, [&] {
    const v1::DaemonStatus status = daemon.conductor->status();
    return std::all_of(status.cameras().begin(), status.cameras().end(),
                       [](const auto& camera) { return camera.state() == v1::CameraStatus::ENDED; });
  }));
  go_round(daemon);
  for (const char* id : {"left", "right"}) {
    EXPECT_THAT(journal_of(daemon, id),
                ElementsAre(std::string(id) + ": the recording that it replays is over."));
  }
  EXPECT_EQ(daemon.conductor->status().cameras(0).light(), v1::AMBER);
  const Status refused = daemon.record("take");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::refused);
  EXPECT_THAT(refused.error().message(), HasSubstr("left has replayed its recording to the end"));
  EXPECT_EQ(daemon.conductor->phase(), v1::IDLE);
  EXPECT_FALSE(std::filesystem::exists(temp_.path() / "sessions" / "take"));
}

TEST_F(Faults, AReplayThatEndsEndsItsRecording) {
  SmallDaemon daemon(config(), options());
  ASSERT_TRUE(soon(daemon, all_film(daemon)));
  ASSERT_TRUE(daemon.record("take").ok());
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->status().recording().frames() > 10; }));
  test::ail("left", test::Ails::ended);
  test::ail("right", test::Ails::ended);
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->phase() == v1::IDLE; }));
  EXPECT_EQ(daemon.conductor->status().recording().state(), v1::RecordingStatus::COMPLETE)
      << daemon.conductor->status().recording().verdict();
}

using FaultsSlow = Faults;

TEST_F(FaultsSlow, ACameraThatHangsIsToldOnceAndARecordingThatGetsNoFrameEndsInAClearError) {
  test::ail("right", test::Ails::mute);  // says that it films
  SmallDaemon daemon(config(), options());
  test::ail("left", test::Ails::hangs);
  ASSERT_TRUE(soon(daemon, [&] { return daemon.fault(v1::Fault::CAMERA_HANGS) != nullptr; }));
  ASSERT_TRUE(daemon.record("take").ok());
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->phase() == v1::IDLE; }));
  const v1::RecordingStatus recording = daemon.conductor->status().recording();
  EXPECT_EQ(recording.state(), v1::RecordingStatus::FAILED);
  EXPECT_THAT(recording.verdict(), HasSubstr("not one frame came from any camera"));
  const v1::Fault* nothing = daemon.fault(v1::Fault::NOTHING_RECORDED);
  ASSERT_NE(nothing, nullptr);
  EXPECT_FALSE(nothing->remedy().empty());
  EXPECT_EQ(daemon.status.light(), v1::RED);
  go_round(daemon);
  EXPECT_THAT(journal_of(daemon, "left"), SizeIs(AllOf(Ge(1U), Le(3U))));
  EXPECT_THAT(daemon.board.notices(0), SizeIs(Le(12U)));
}

/// A disk that takes nothing any more: whatever is written to this file waits until somebody reads it.
class StuckFile {
 public:
  explicit StuckFile(std::filesystem::path path) : path_(std::move(path)) {
    EXPECT_EQ(::mkfifo(path_.c_str(), 0600), 0) << path_;
  }
  StuckFile(const StuckFile&) = delete;
  StuckFile& operator=(const StuckFile&) = delete;
  ~StuckFile() { let_go(); }
  void let_go() {
    if (reader_.joinable()) return;
    reader_ = std::jthread([this](const std::stop_token& stop) {
      const UniqueFd fd(::open(path_.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
      std::array<char, 1 << 16> bytes{};
      while (!stop.stop_requested())
        if (::read(fd.get(), bytes.data(), bytes.size()) <= 0)
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
    });
  }

 private:
  std::filesystem::path path_;
  std::jthread reader_;
};

TEST_F(Faults, WhileADiskTakesNothingARecordingIsFinishedBesideAllElse) {
  SmallDaemon daemon(config(), options());
  ASSERT_TRUE(soon(daemon, all_film(daemon)));
  ASSERT_TRUE(daemon.record("take").ok());
  // Before its first frame: segments are made when that comes.
  StuckFile stuck(temp_.path() / "sessions" / "take" / "left" / "000000.nut");
  ASSERT_TRUE(films_on(daemon, 60));
  ASSERT_TRUE(daemon.conductor->stop_recording().ok());
  const TimePoint stopped = SteadyClock().now();
  ASSERT_TRUE(soon(daemon, [&] { return SteadyClock().now() - stopped > Seconds(1); }));
  const v1::DaemonStatus status = daemon.conductor->status();
  EXPECT_EQ(status.phase(), v1::FINISHING);
  EXPECT_EQ(status.recording().state(), v1::RecordingStatus::FINISHING);
  EXPECT_FALSE(daemon.conductor->is_done());
  EXPECT_EQ(daemon.conductor->record({}).error().kind, ErrorKind::refused);
  stuck.let_go();
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->phase() == v1::IDLE; }));
  EXPECT_TRUE(daemon.conductor->is_done());
  EXPECT_TRUE(daemon.record("take").error().kind == ErrorKind::bad_input);  // its name is taken
}

/// Simulated cameras of 100 frames a second in real time.
class Overload : public Faults {
 protected:
  rig::DaemonConfig config() {
    rig::DaemonConfig config = test::small_config(temp_.path());
    config.rig.cameras[0].request.size = ImageSize{64, 48};
    config.rig.cameras[0].request.frame_rate = Hertz(100);
    config.rig.virtual_rig.time = rig::VirtualConfig::Time::real;
    return config;
  }
  static const v1::Fault* overload(SmallDaemon& daemon, const std::string& cause) {
    daemon.status = daemon.conductor->status();
    for (const v1::Fault& fault : daemon.status.faults())
      if (fault.kind() == v1::Fault::OVERLOADED && fault.subject() == cause) return &fault;
    return nullptr;
  }
};

TEST_F(Overload, ASlowProcessorIsOneFaultOfItsOwnAndNoCameraIsBlamed) {
  std::atomic<bool> slow = true;
  rig::RigOptions rig = options();
  rig.on_frame = [&slow](std::size_t,
                         const Frame&) {  // as much work for a frame as four of them give time for
    const TimePoint until = SteadyClock().now() + milliseconds(40);
    while (slow && SteadyClock().now() < until) {
    }
  };
  SmallDaemon daemon(config(), rig);
  ASSERT_TRUE(soon(daemon, [&] { return overload(daemon, "processor") != nullptr; }));
  EXPECT_EQ(daemon.fault(v1::Fault::CAMERA_HANGS), nullptr);
  EXPECT_EQ(daemon.status.light(), v1::AMBER);
  EXPECT_THAT(overload(daemon, "processor")->what(), HasSubstr("the processor can't keep up"));
  EXPECT_THAT(overload(daemon, "processor")->remedy(), HasSubstr("the cameras are well"));
  const TimePoint from = SteadyClock().now();
  ASSERT_TRUE(soon(daemon, [&] { return SteadyClock().now() - from > Seconds(1.5); }));
  const v1::DaemonStatus status = daemon.conductor->status();
  for (const v1::CameraStatus& camera : status.cameras()) {
    if (camera.lost_lately() == 0) continue;
    EXPECT_EQ(camera.light(), v1::AMBER) << "what loses frames isn't well";
    EXPECT_THAT(camera.reason(), HasSubstr("frames were lost within 10 s"));
  }
  EXPECT_THAT(daemon.board.notices(0), SizeIs(1)) << "one line for the cause, not one a camera a second";
  slow = false;
}

TEST_F(Overload, ASlowDiskIsToldAsSuch) {
  SmallDaemon daemon(config(), options());
  ASSERT_TRUE(soon(daemon, all_film(daemon)));
  ASSERT_TRUE(daemon.record("take").ok());
  const std::filesystem::path folder = temp_.path() / "sessions" / "take";
  StuckFile stuck(folder / "virtual-00" / "000000.nut");
  ASSERT_TRUE(soon(daemon, [&] { return overload(daemon, "disk") != nullptr; }));
  EXPECT_THAT(overload(daemon, "disk")->remedy(), HasSubstr("faster disk"));
  EXPECT_EQ(daemon.status.cameras(0).state(), v1::CameraStatus::FILMING);
  ASSERT_TRUE(daemon.conductor->stop_recording().ok());
  stuck.let_go();
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->phase() == v1::IDLE; }));
  EXPECT_THAT(daemon.conductor->status().recording().verdict(), HasSubstr("as the disk was too slow"));
}

}  // namespace
}  // namespace emberlock
