// SPDX-License-Identifier: Apache-2.0
// The CHDK camera of tests/support/chdk_responder, behind QEMU's usbredir, the kernel's USB and libusb. Where
// a test prints what it measured, that is of this camera under emulation, not of a Canon's.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <poll.h>
#include <sys/wait.h>

#include "drivers/ptp/chdk_camera.h"
#include "drivers/ptp/clips.h"
#include "drivers/ptp/driver.h"
#include "tests/vm/ptp/usb_bed.h"

namespace emberlock {
namespace {

using testing::HasSubstr;

constexpr const char* kId = "EMBER0001";
const drivers::CameraRequest kGray{.format = PixelFormat::gray8};

/// How often to do what is done again and again: EMBERLOCK_VM_ROUNDS, 100 for the full length.
int rounds_or(int usual) {
  const char* asked = std::getenv("EMBERLOCK_VM_ROUNDS");
  return asked != nullptr ? std::atoi(asked) : usual;
}

class ChdkOnUsb : public UsbBed {
 protected:
  void SetUp() override {
    plug_chdk();
    const auto connection = connect(true);
    ASSERT_TRUE(connection.ok()) << connection.error().message();
  }
  std::unique_ptr<drivers::Camera> filming(const drivers::CameraRequest& request = kGray) {
    auto camera = drivers::ptp_driver().open(kId, request);
    EXPECT_TRUE(camera.ok()) << camera.error().message();
    if (!camera.ok()) return nullptr;
    const Status started = (*camera)->start();
    EXPECT_TRUE(started.ok()) << started.error().message();
    return std::move(*camera);
  }
  Result<Frame> frame(drivers::Camera& camera) {
    const TimePoint until = clock_.now() + test::kHangGuard;
    auto result = camera.next_frame(milliseconds(20));
    while (!result.ok() && result.error().kind == ErrorKind::timed_out && clock_.now() < until) {
      result = camera.next_frame(milliseconds(20));
    }
    return result;
  }
  /// How long until the camera films again, once it is plugged in.
  Seconds return_of(drivers::Camera& camera) {
    const TimePoint plugged = clock_.now();
    EXPECT_TRUE(test::wait_until([&] { return camera.start().ok(); }));
    EXPECT_TRUE(frame(camera).ok());
    return clock_.now() - plugged;
  }
};

TEST_F(ChdkOnUsb, IsFoundWithWhatItCanDo) {
  const auto found = drivers::ptp_driver().find();
  ASSERT_TRUE(found.ok()) << found.error().message();
  ASSERT_EQ(found->size(), 1u);
  EXPECT_EQ(found->front().id, kId);
  EXPECT_EQ(found->front().model, "Canon PowerShot E1");
  EXPECT_EQ(found->front().reset, ShutterReset::on_command);
  EXPECT_THAT(found->front().notes, testing::Contains(HasSubstr("CHDK 2.9")));
  EXPECT_THAT(found->front().address, testing::StartsWith("usb-"));
  EXPECT_GE(found->front().link_megabits.value_or(0), 12);
}

TEST_F(ChdkOnUsb, ScriptsAndMessagesGoBothWays) {
  auto connection = drivers::connect_ptp(kId);
  ASSERT_TRUE(connection.ok()) << connection.error().message();
  drivers::Chdk chdk(*connection->session);
  EXPECT_THAT(
      chdk.run("return get_mode()").value(),
      testing::ElementsAre(drivers::ChdkValue(false), drivers::ChdkValue(false), drivers::ChdkValue(2)));
  ASSERT_TRUE(chdk.start_script("write_usb_msg(\"ready\"); return read_usb_msg(1000)").ok());
  EXPECT_EQ(std::get<std::string>(chdk.read_message()->value), "ready");
  ASSERT_TRUE(chdk.write_message("go").ok());
  EXPECT_EQ(std::get<std::string>(chdk.read_message()->value), "go");
  EXPECT_THAT(chdk.run("error(\"no card\")").error().message(), HasSubstr("no card"));

  constexpr int kTransactions = 300;
  const TimePoint begin = clock_.now();
  for (int i = 0; i < kTransactions; ++i) ASSERT_TRUE(chdk.version().ok());
  fmt::print("{:.0f} transactions/s\n", kTransactions / (clock_.now() - begin).value());
}

TEST_F(ChdkOnUsb, ALiveViewIsFilmed) {
  auto camera = filming({});
  ASSERT_TRUE(camera);
  const TimePoint begin = clock_.now();
  constexpr std::uint64_t kFrames = 30;
  for (std::uint64_t i = 0; i < kFrames; ++i) {
    const auto got = frame(*camera);
    ASSERT_TRUE(got.ok()) << got.error().message();
    EXPECT_EQ(got->stamp.frame_id, i);
  }
  const Seconds took = clock_.now() - begin;
  EXPECT_EQ(camera->counts().delivered, kFrames);
  EXPECT_EQ(camera->counts().lost(), 0u);
  constexpr double kBytes = 384 * 240 * 1.5;
  fmt::print("live view: {:.1f} frames/s, {:.1f} MB/s\n", kFrames / took.value(),
             kFrames * kBytes * 1e-6 / took.value());
}

TEST_F(ChdkOnUsb, AResetShowsTheNewPhaseInTheNextFrame) {
  for (const char* action : {"mode", "movie"}) {
    auto camera = filming({.format = PixelFormat::gray8, .controls = {{"reset", action}}});
    ASSERT_TRUE(camera);
    std::vector<double> latencies;
    for (int i = 0; i < rounds_or(4); ++i) {
      const auto before = frame(*camera);
      ASSERT_TRUE(before.ok()) << before.error().message();
      ASSERT_TRUE(camera->reset_shutter(clock_.now()).ok());
      const auto after = frame(*camera);
      ASSERT_TRUE(after.ok()) << after.error().message();
      EXPECT_EQ(after->image->view().sample(0, 0), (before->image->view().sample(0, 0) + 1) % 256);
      const auto reset = dynamic_cast<drivers::ChdkCamera&>(*camera).last_reset();
      ASSERT_TRUE(reset && reset->first_frame);
      latencies.push_back(in_milliseconds(*reset->first_frame - reset->at));
    }
    const double n = static_cast<double>(latencies.size());
    const double mean = std::accumulate(latencies.begin(), latencies.end(), 0.0) / n;
    double squares = 0;
    for (const double l : latencies) squares += (l - mean) * (l - mean);
    fmt::print("reset by {}: {:.0f} ms on average, jitter {:.0f} ms (sigma of {})\n", action, mean,
               std::sqrt(squares / (n - 1)), n);
    EXPECT_EQ(camera->counts().lost(), 0u);
  }
}

TEST_F(ChdkOnUsb, AMovieIsMadeAndDownloaded) {
  auto connection = drivers::connect_ptp(kId);
  ASSERT_TRUE(connection.ok()) << connection.error().message();
  drivers::Chdk chdk(*connection->session);
  ASSERT_TRUE(chdk.change_mode(drivers::ChdkMode::record).ok());
  ASSERT_TRUE(test::wait_until([&] { return chdk.mode().value() == drivers::ChdkMode::record; }));
  const std::size_t before = drivers::list_clips(*connection->session)->size();
  ASSERT_TRUE(drivers::start_movie(chdk, clock_).ok());
  ASSERT_TRUE(drivers::stop_movie(chdk, clock_).ok());
  const auto clips = drivers::list_clips(*connection->session).value();
  ASSERT_EQ(clips.size(), before + 1);
  const std::filesystem::path target = "/tmp/" + clips.back().name;
  const TimePoint begin = clock_.now();
  const Status done = drivers::download_clip(*connection->session, clips.back(), target);
  ASSERT_TRUE(done.ok()) << done.error().message();
  fmt::print("movie: {} bytes at {:.1f} MB/s\n", clips.back().bytes,
             clips.back().bytes * 1e-6 / (clock_.now() - begin).value());
  EXPECT_EQ(std::filesystem::file_size(target), clips.back().bytes);
  EXPECT_TRUE(drivers::verify_clip(target).ok());
}

TEST_F(ChdkOnUsb, FaultsCostAFrameOrATimeAndNoMore) {
  auto camera = filming();
  ASSERT_TRUE(camera);
  for (const char* fault :
       {"wrong_transaction", "long_length", "short_length", "garbage", "stall", "bad_live_view"}) {
    ASSERT_TRUE(frame(*camera).ok()) << fault;
    const std::uint64_t lost = camera->counts().lost();
    tell(fmt::format("{} 1", fault));
    const auto next = frame(*camera);
    ASSERT_TRUE(next.ok()) << fault << ": " << next.error().message();
    EXPECT_EQ(camera->counts().lost(), lost + 1) << fault;
  }
  for (const char* oddity : {"header_alone", "no_empty_packet"}) {
    const std::uint64_t lost = camera->counts().lost();
    tell(fmt::format("{} 3", oddity));
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(frame(*camera).ok()) << oddity;
    EXPECT_EQ(camera->counts().lost(), lost) << oddity;
  }
  tell("latency 150");
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(frame(*camera).ok());
}

TEST_F(ChdkOnUsb, ACameraThatHangsIsGivenUpAndWellAgainItFilms) {
  auto camera = filming();
  ASSERT_TRUE(camera);
  ASSERT_TRUE(frame(*camera).ok());
  tell("hang -1");
  const TimePoint hung = clock_.now();
  const auto gone = frame(*camera);
  ASSERT_FALSE(gone.ok());
  EXPECT_EQ(gone.error().kind, ErrorKind::device);
  fmt::print("hangs: said after {:.1f} s: {}\n", (clock_.now() - hung).value(), gone.error().message());
  EXPECT_FALSE(camera->start().ok());
  tell("well");
  fmt::print("well again: films after {:.1f} s\n", return_of(*camera).value());
}

TEST_F(ChdkOnUsb, AHangingCameraIsLeft) {
  auto camera = filming();
  ASSERT_TRUE(camera);
  tell("hang -1");
  (void)camera->next_frame(milliseconds(100));
  camera->stop();
  camera.reset();
}

/// Another process that has the camera, until this is destroyed.
class OtherProcess {
 public:
  OtherProcess() {
    int ends[2] = {};
    EXPECT_EQ(::pipe(ends), 0);
    pid_ = ::fork();
    if (pid_ == 0) {
      const auto held = drivers::connect_ptp(kId);
      if (held.ok()) (void)!::write(ends[1], "y", 1);
      ::pause();
    }
    ::close(ends[1]);
    const UniqueFd told(ends[0]);
    char answer = 0;
    pollfd ready{told.get(), POLLIN, 0};
    EXPECT_TRUE(::poll(&ready, 1, 5000) == 1 && ::read(told.get(), &answer, 1) == 1)
        << "it doesn't get the camera";
  }
  OtherProcess(const OtherProcess&) = delete;
  OtherProcess& operator=(const OtherProcess&) = delete;
  ~OtherProcess() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  pid_t pid_ = -1;
};

TEST_F(ChdkOnUsb, OneThatAnotherProcessHasIsListedWithItsHolder) {
  {
    const OtherProcess other;
    const auto found = drivers::ptp_driver().find();
    ASSERT_TRUE(found.ok()) << found.error().message();
    ASSERT_EQ(found->size(), 1u);
    EXPECT_EQ(found->front().id, kId) << "its USB descriptor says it too";
    ASSERT_TRUE(found->front().holder);
    EXPECT_EQ(found->front().holder->pid, other.pid());
    EXPECT_EQ(found->front().holder->program, "vm_ptp");
    const auto refused = drivers::ptp_driver().open(kId, {});
    ASSERT_FALSE(refused.ok());
    EXPECT_THAT(refused.error().message(), HasSubstr(fmt::format("vm_ptp (process {})", other.pid())));
  }
  EXPECT_TRUE(drivers::ptp_driver().open(kId, {}).ok()) << "what a killed process left behind is recovered";
}

struct Held {
  std::ptrdiff_t files;
  std::ptrdiff_t threads;
  std::size_t bytes;
};
Held held() {
  namespace fs = std::filesystem;
  const auto entries = [](const char* folder) { return std::distance(fs::directory_iterator(folder), {}); };
  return {entries("/proc/self/fd"), entries("/proc/self/task"), ::mallinfo2().uordblks};
}

TEST_F(ChdkOnUsb, UnpluggedAndPluggedInAgainAndAgainItFilmsAndLeaksNothing) {
  const int rounds = rounds_or(3);
  constexpr int kWarmUp = 2;
  auto camera = filming();
  ASSERT_TRUE(camera);
  ASSERT_TRUE(frame(*camera).ok());
  Held begin{};
  Seconds said_worst, said_sum, back_worst, back_sum;
  for (int round = 0; round < kWarmUp + rounds; ++round) {
    if (round == kWarmUp) begin = held();
    const TimePoint pulled = clock_.now();
    EXPECT_TRUE(qmp_->unplug("chdk").ok());
    const auto gone = frame(*camera);
    const Seconds said = clock_.now() - pulled;
    ASSERT_FALSE(gone.ok());
    EXPECT_EQ(gone.error().kind, ErrorKind::device);
    EXPECT_FALSE(camera->start().ok());
    plug_chdk();
    const Seconds back = return_of(*camera);
    if (round < kWarmUp) continue;
    said_sum += said;
    back_sum += back;
    said_worst = std::max(said_worst, said);
    back_worst = std::max(back_worst, back);
  }
  const Held end = held();
  EXPECT_EQ(end.files, begin.files);
  EXPECT_EQ(end.threads, begin.threads);
  EXPECT_LE(end.bytes, begin.bytes + 100'000);
  fmt::print(
      "{} rounds: unplugged, said after {:.0f} ms (worst {:.0f}); plugged in, films after {:.0f} ms (worst "
      "{:.0f}); "
      "{} files, {} threads, {:+} bytes\n",
      rounds, in_milliseconds(said_sum / rounds), in_milliseconds(said_worst),
      in_milliseconds(back_sum / rounds), in_milliseconds(back_worst), end.files, end.threads,
      static_cast<std::ptrdiff_t>(end.bytes) - static_cast<std::ptrdiff_t>(begin.bytes));
}

}  // namespace
}  // namespace emberlock
