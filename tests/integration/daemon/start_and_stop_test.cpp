// SPDX-License-Identifier: Apache-2.0
// emberlockd as systemd sees it: ready at once whatever has to be salvaged, ended at once whatever it does,
// and nothing that reached the disk is lost by it.
#include <array>
#include <chrono>
#include <csignal>
#include <cstring>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/unique_fd.h"
#include "session/camera_reader.h"
#include "tests/support/daemon_test.h"

namespace emberlock {
namespace {

using ::testing::HasSubstr;

constexpr std::size_t kCamerasLeft = 11;
constexpr std::size_t kFramesLeft = 1560;  // 65 s

/// What a program tells systemd, which reads all of it.
class NotifySocket {
 public:
  explicit NotifySocket(std::filesystem::path path) : path_(std::move(path)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(static_cast<char*>(address.sun_path), path_.c_str(), sizeof address.sun_path - 1);
    socket_ = UniqueFd(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    EXPECT_EQ(::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    reader_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
  }
  /// Waits for a message that has `words`, and came after all that were heard before.
  bool hears(const std::string& words) {
    return test::wait_until([&] {
      const std::lock_guard lock(mutex_);
      while (heard_ < messages_.size())
        if (messages_[heard_++].find(words) != std::string::npos) return true;
      return false;
    });
  }
  /// Only what comes from now on is heard.
  void forget() {
    const std::lock_guard lock(mutex_);
    heard_ = messages_.size();
  }
  [[nodiscard]] std::string path() const { return path_.string(); }

 private:
  void read(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      pollfd ready{socket_.get(), POLLIN, 0};
      if (::poll(&ready, 1, 20) <= 0) continue;
      std::array<char, 4096> text{};
      const ssize_t length = ::recv(socket_.get(), text.data(), text.size(), 0);
      if (length <= 0) continue;
      const std::lock_guard lock(mutex_);
      messages_.emplace_back(text.data(), static_cast<std::size_t>(length));
    }
  }

  std::filesystem::path path_;
  UniqueFd socket_;
  std::mutex mutex_;
  std::vector<std::string> messages_;
  std::size_t heard_ = 0;
  std::jthread reader_;
};

class StartAndStop : public test::DaemonTest {
 protected:
  StartAndStop()
      : DaemonTest({.cameras = 2,
                    .size = "160x120",
                    .strobe = "none",
                    .recording = "queue_s = 60\nqueue_mib = 1024\n"}),
        systemd_(temp_ / "notify") {}
  [[nodiscard]] test::Environment environment(test::Environment more = {}) const {
    more.emplace_back("NOTIFY_SOCKET", systemd_.path());
    return more;
  }
#ifdef SLOW_DISK_LIBRARY
  /// With a disk that takes so many ms for each frame, and takes none while the file disk_is_stuck() exists.
  [[nodiscard]] test::Environment slow_disk(int ms) const {
    return environment({{"LD_PRELOAD", SLOW_DISK_LIBRARY},
                        {"EMBERLOCK_SLOW_DISK_MS", std::to_string(ms)},
                        {"EMBERLOCK_SLOW_DISK_STUCK", disk_is_stuck()},
                        {"WATCHDOG_USEC", "2000000"}});
  }
  [[nodiscard]] std::string disk_is_stuck() const { return (temp_ / "stuck").string(); }
#endif
  /// Eleven cameras of 65 s in a segment each, as a recorder that was killed leaves them.
  void leave_unfinished(const std::string& session, ImageSize size = {32, 24}) const {
    const ImageLayout layout{size, PixelFormat::gray8, 8};
    const auto folder = sessions() / session;
    std::filesystem::create_directories(sessions());
    auto manifest = test::manifest_of(std::vector(kCamerasLeft, layout));
    {
      auto writer = session::SessionWriter::create(folder, manifest, test::small_disk_options());
      Frame frame = test::noise_frame(layout, 0);
      for (std::size_t i = 0; i < kFramesLeft; ++i) {
        frame.stamp = test::noise_frame({{2, 2}, PixelFormat::gray8, 8}, i).stamp;
        ASSERT_TRUE(writer->write(0, frame));
      }
    }
    for (std::size_t c = 1; c < kCamerasLeft; ++c) {
      const auto other = folder / ("cam" + std::to_string(c));
      std::filesystem::remove_all(other);
      std::filesystem::copy(folder / "cam0", other);
    }
  }

  NotifySocket systemd_;
};

using StartAndStopSlow = StartAndStop;

TEST_F(StartAndStopSlow, ItIsReadyBeforeElevenLongSegmentsAreSalvaged) {
  leave_unfinished("killed", {160, 120});
  test::Program daemon(command(), environment());
  ASSERT_TRUE(systemd_.hears("READY=1"));
  // Decoding all frames takes twenty times as long. On a busy machine processor time says more than a clock.
  EXPECT_LT(daemon.processor_seconds(), 1);
  ASSERT_TRUE(answers("sessions list", "SALVAGED"));
  const v1::Manifest manifest = session::read_manifest(sessions() / "killed").value();
  for (const v1::CameraStream& camera : manifest.cameras()) {
    EXPECT_GT(camera.counts().recorded() + 60, kFramesLeft);
    EXPECT_EQ(camera.counts().recorded(), indexed_frames("killed", camera.camera_id()));
  }
  EXPECT_EQ(daemon.end(SIGTERM), 0);
}

TEST_F(StartAndStop, EndedOrKilledInMidSalvageTheNextStartGoesOnAndLosesNothing) {
  leave_unfinished("killed");
  for (const int signal : {SIGTERM, SIGKILL, SIGTERM, SIGKILL, SIGINT}) {
    test::Program daemon(command(), environment());
    ASSERT_TRUE(systemd_.hears("READY=1"));
    EXPECT_EQ(daemon.end(signal), signal == SIGKILL ? -SIGKILL : 0);
  }
  test::Program daemon(command(), environment());
  ASSERT_TRUE(answers("sessions list", "SALVAGED"));
  const session::SessionCheck check = expect_whole("killed");
  for (const session::CameraCheck& camera : check.cameras) EXPECT_EQ(camera.good, check.cameras[0].good);
}

TEST_F(StartAndStop, ARecordingMayBeginWhileSalvageRunsWhichGoesOnAfterIt) {
  leave_unfinished("killed");
  test::Program daemon(command(), environment());
  ASSERT_TRUE(systemd_.hears("READY=1"));
  ASSERT_TRUE(answers("status", "filming"));
  const Shell recorded = client("record take --unlocked --seconds 1");
  EXPECT_EQ(recorded.status, 0) << recorded.output;
  EXPECT_THAT(recorded.output, HasSubstr("none lost"));
  ASSERT_TRUE(answers("sessions list", "SALVAGED"));
  expect_whole("killed");
}

#ifdef SLOW_DISK_LIBRARY
TEST_F(StartAndStop, AskedToEndWithASlowDiskItAsksForTimeAsLongAsItGetsOnAndKeepsEveryFrame) {
  test::Program daemon(command(), slow_disk(100));
  ASSERT_TRUE(systemd_.hears("READY=1"));
  ASSERT_TRUE(answers("status", "filming"));
  std::thread recording([&] { static_cast<void>(client("record slow --unlocked")); });
  // As many as the disk takes three seconds for.
  EXPECT_TRUE(test::wait_until([&] {
    return number(this->recording().value("progress", nlohmann::json::object()), "queued") > 2 * 30;
  }));
  daemon.send(SIGTERM);
  EXPECT_TRUE(systemd_.hears("STOPPING=1"));
  EXPECT_TRUE(systemd_.hears("EXTEND_TIMEOUT_USEC="));
  EXPECT_TRUE(systemd_.hears("EXTEND_TIMEOUT_USEC="));  // as it gets on
  EXPECT_EQ(daemon.wait(), 0);
  recording.join();
  EXPECT_EQ(expect_whole("slow").state, v1::Manifest::COMPLETE);
  const auto manifest = session::read_manifest(sessions() / "slow").value();
  for (const v1::CameraStream& camera : manifest.cameras()) {
    EXPECT_GE(camera.counts().recorded(), 20U);
    EXPECT_EQ(camera.counts().queue() + camera.counts().disk(), 0U);
  }
}

TEST_F(StartAndStop, WhileASlowDiskIsWaitedForTheWatchdogIsFedAndCallsAreAnswered) {
  test::put_bytes(disk_is_stuck(), "");
  test::Program daemon(command(), slow_disk(0));
  ASSERT_TRUE(systemd_.hears("READY=1"));
  ASSERT_TRUE(answers("status", "filming"));
  std::thread recording([&] {
    const Shell recorded = client("record slow --unlocked --seconds 1");
    EXPECT_EQ(recorded.status, 0) << recorded.output;
    EXPECT_THAT(recorded.output, HasSubstr("none lost"));
  });
  EXPECT_TRUE(answers("status", "finishing"));
  systemd_.forget();
  EXPECT_TRUE(systemd_.hears("WATCHDOG=1"));
  EXPECT_TRUE(systemd_.hears("WATCHDOG=1"));
  EXPECT_THAT(client("record other --unlocked").output, HasSubstr("slow is being recorded"));
  std::filesystem::remove(disk_is_stuck());
  recording.join();
}

TEST_F(StartAndStop, ASecondSignalEndsItAtOnceAndTheNextStartSalvagesAllThatReachedTheDisk) {
  {
    test::Program daemon(command(), slow_disk(500));
    ASSERT_TRUE(systemd_.hears("READY=1"));
    ASSERT_TRUE(answers("status", "filming"));
    std::thread recording([&] { static_cast<void>(client("record slow --unlocked")); });
    EXPECT_TRUE(every_camera_has(1, "slow"));
    test::put_bytes(disk_is_stuck(), "");
    const auto begun = std::chrono::steady_clock::now();
    daemon.send(SIGTERM);
    EXPECT_TRUE(systemd_.hears("STOPPING=1"));
    std::optional<int> status;
    EXPECT_TRUE(test::wait_until([&] {
      daemon.send(SIGTERM);
      return (status = daemon.ended()).has_value();
    }));
    EXPECT_EQ(status, EXIT_FAILURE);
    EXPECT_GE(std::chrono::steady_clock::now() - begun, std::chrono::milliseconds(500))
        << "wrappers pass a signal on twice";
    recording.join();
    std::filesystem::remove(disk_is_stuck());
  }
  const v1::Manifest left = session::read_manifest(sessions() / "slow").value();
  EXPECT_EQ(left.state(), v1::Manifest::RECORDING);
  std::vector<std::size_t> indexed;
  for (const v1::CameraStream& camera : left.cameras())
    indexed.push_back(indexed_frames("slow", camera.camera_id()));
  test::Program daemon(command(), environment());
  ASSERT_TRUE(answers("sessions list", "SALVAGED"));
  const session::SessionCheck check = expect_whole("slow");
  for (std::size_t i = 0; i < indexed.size(); ++i) {
    EXPECT_GT(indexed[i], 0U);
    EXPECT_GE(check.cameras[i].good, indexed[i]) << "the index tells of a frame once it is written";
  }
}
#endif

}  // namespace
}  // namespace emberlock
