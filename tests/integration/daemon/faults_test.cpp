// What goes wrong in a lab: each time the operator is told what happened and what to do, and what was
// recorded stays.
#include <chrono>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "session/reader.h"
#include "session/verify.h"
#include "tests/support/small_daemon.h"
#include "tests/support/socket_cameras.h"

namespace emberlock {
namespace {

using test::SmallDaemon;
using ::testing::HasSubstr;

class Faults : public ::testing::Test {
 protected:
  Faults() {
    test::plug_in("left");
    test::plug_in("right");
  }

  /// Two cameras that film in real time.
  DaemonConfig config() {
    DaemonConfig config = test::small_config(temp_.path());
    config.rig.cameras.clear();
    for (const char* id : {"left", "right"}) {
      CameraConfig camera;
      camera.source = CameraSource::v4l2;
      camera.id = id;
      config.rig.cameras.push_back(camera);
    }
    config.rig.virtual_rig.time = VirtualConfig::Time::real;
    config.rig.strobe.source = StrobeSource::none;
    return config;
  }
  RigOptions options() {
    RigOptions options;
    options.drivers = drivers_;
    return options;
  }
  /// Works in real time.
  static bool soon(SmallDaemon& daemon, const std::function<bool()>& holds, Seconds deadline = Seconds(5)) {
    const TimePoint until = SteadyClock().now() + deadline;
    while (!holds() && SteadyClock().now() < until) {
      daemon.conductor->work();
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return holds();
  }
  static bool all_film(SmallDaemon& daemon) {
    const v1::DaemonStatus status = daemon.conductor->status();
    return std::all_of(status.cameras().begin(), status.cameras().end(), [](const v1::CameraStatus& camera) {
      return camera.state() == v1::CameraStatus::FILMING && camera.counts().delivered() > 0;
    });
  }
  static Status record(SmallDaemon& daemon) {
    v1::RecordRequest request;
    request.set_name("take");
    request.set_unlocked(true);
    return daemon.conductor->record(request);
  }
  SessionReader take() { return SessionReader::open(temp_.path() / "sessions" / "take").value(); }

  test::TempFolder temp_;
  std::vector<CameraDriver> drivers_ = test::socket_drivers();
};

TEST_F(Faults, ACameraThatGoesAndComesBackIsToldAndTheOthersLoseNothing) {
  SmallDaemon daemon(config(), options());
  ASSERT_TRUE(soon(daemon, [&] { return all_film(daemon); }));
  ASSERT_TRUE(record(daemon).ok());
  const TimePoint began = SteadyClock().now();
  ASSERT_TRUE(soon(daemon, [&] { return SteadyClock().now() - began > milliseconds(300); }));
  test::unplug("left");
  ASSERT_TRUE(soon(
      daemon, [&] { return daemon.fault(v1::Fault::CAMERA_LOST) != nullptr; }, Seconds(1)));
  EXPECT_EQ(daemon.fault(v1::Fault::CAMERA_LOST)->subject(), "left");
  EXPECT_FALSE(daemon.fault(v1::Fault::CAMERA_LOST)->remedy().empty());
  EXPECT_EQ(daemon.status.light(), v1::RED);
  EXPECT_THAT(daemon.status.next_step(), HasSubstr("left"));
  EXPECT_EQ(daemon.conductor->phase(), v1::CAPTURING);
  test::plug_in("left");
  ASSERT_TRUE(soon(
      daemon, [&] { return daemon.fault(v1::Fault::CAMERA_LOST)->over(); }, Seconds(3)));
  ASSERT_TRUE(daemon.conductor->stop_recording().ok());
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->phase() == v1::IDLE; }));
  EXPECT_EQ(daemon.conductor->status().recording().state(), v1::RecordingStatus::COMPLETE)
      << daemon.conductor->status().recording().verdict();
  SessionReader session = take();
  const auto& stamps = session.stamps(1);
  ASSERT_GT(stamps.size(), 20U);
  for (std::size_t i = 1; i < stamps.size(); ++i) EXPECT_EQ(stamps[i].frame_id, stamps[i - 1].frame_id + 1);
  EXPECT_GT(session.stamps(0).size(), 10U);
}

TEST_F(Faults, AllCamerasLostIsOneFaultMoreAndWhatWasRecordedStays) {
  SmallDaemon daemon(config(), options());
  ASSERT_TRUE(soon(daemon, [&] { return all_film(daemon); }));
  ASSERT_TRUE(record(daemon).ok());
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->status().recording().frames() > 40; }));
  test::unplug("left");
  test::unplug("right");
  ASSERT_TRUE(soon(
      daemon, [&] { return daemon.fault(v1::Fault::ALL_CAMERAS_LOST) != nullptr; }, Seconds(1)));
  ASSERT_TRUE(daemon.conductor->stop_recording().ok());
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->phase() == v1::IDLE; }));
  EXPECT_GE(daemon.conductor->status().recording().frames(), 40U);
  EXPECT_TRUE(verify_session(temp_.path() / "sessions" / "take")->whole());
}

TEST_F(Faults, ADiskBelowItsFloorEndsTheRecordingWithEveryFrameAccountedFor) {
  DaemonConfig full = config();
  full.recording.writer.min_free_bytes = std::uint64_t{1} << 60;
  SmallDaemon daemon(full, options());
  ASSERT_TRUE(soon(daemon, [&] { return all_film(daemon); }));
  ASSERT_TRUE(record(daemon).ok());
  ASSERT_TRUE(soon(daemon, [&] { return daemon.conductor->phase() == v1::IDLE; }));
  const v1::Fault* failed = daemon.fault(v1::Fault::DISK_FAILED);
  ASSERT_NE(failed, nullptr);
  EXPECT_THAT(failed->what(), HasSubstr("floor"));
  EXPECT_THAT(failed->remedy(), HasSubstr("Free space"));
  const v1::RecordingStatus recording = daemon.conductor->status().recording();
  EXPECT_EQ(recording.frames(), 0U);
  EXPECT_GT(recording.lost().disk(), 0U);
  EXPECT_EQ(recording.state(), v1::RecordingStatus::COMPLETE) << recording.verdict();
}

TEST_F(Faults, ASilentStrobeIsWaitedForAndSaidSo) {
  DaemonConfig silent = config();
  silent.rig.strobe.source = StrobeSource::serial;
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
  ASSERT_TRUE(soon(daemon, [&] { return all_film(daemon); }));
  EXPECT_TRUE(daemon.fault(v1::Fault::CAMERA_LOST)->over());
}

}  // namespace
}  // namespace emberlock
