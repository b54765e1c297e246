// SPDX-License-Identifier: Apache-2.0
// Filming: every frame is accounted for, against what the cameras themselves write down.
#include <cmath>
#include <cstdio>
#include <thread>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "tests/integration/aravis/bed_test.h"

namespace emberlock {
namespace {

using namespace testing_support;

class FilmTest : public AravisBed {
 protected:
  static Seconds cpu_time() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return Seconds(seconds(usage.ru_utime) + seconds(usage.ru_stime));
  }
};

std::uint64_t all_of(const drivers::FrameCounts& counts) {
  return counts.delivered + counts.damaged + counts.lost() + counts.passed_over;
}

// EMBERLOCK_ARAVIS_SECONDS=60 for the figure.
TEST_F(FilmTest, ElevenCamerasFilmWithoutAFrameUnaccountedFor) {
  const auto time = Seconds(asked_for("EMBERLOCK_ARAVIS_SECONDS", 3));
  const auto most = static_cast<std::uint64_t>(0.9 * 15 * time.value());  // on a busy machine they come late
  const auto processes = fakes(11, "ELEVEN");
  auto cameras = open_all(processes, small_film());
  ASSERT_EQ(cameras.size(), 11U);
  for (auto& camera : cameras) ASSERT_TRUE(camera->start().ok());
  const Seconds cpu_before = cpu_time();
  std::vector<Film> films(cameras.size());
  {
    std::vector<std::jthread> owners;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      owners.emplace_back([&, i] { films[i] = film_for(*cameras[i], time, most + 1); });
    }
  }
  const Seconds cpu = cpu_time() - cpu_before;
  {
    std::vector<std::jthread> owners;
    for (auto& camera : cameras) owners.emplace_back([&camera] { camera->stop(); });
  }
  std::uint64_t lost = 0, sent = 0, unaccounted = 0;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const drivers::FrameCounts counts = cameras[i]->counts();
    const std::uint64_t its = processes[i]->sent().frames.size();
    EXPECT_EQ(all_of(counts), its) << processes[i]->serial();
    EXPECT_EQ(counts.delivered, films[i].frames);
    EXPECT_LE(films[i].skipped, counts.lost());  // the first frame may find a small socket
    EXPECT_EQ(films[i].wrong_pixels, 0U);
    EXPECT_EQ(films[i].wrong_number, 0U);
    EXPECT_GT(films[i].frames, most);
    EXPECT_FALSE(films[i].error.has_value());
    lost += counts.lost();
    sent += its;
    unaccounted += its > all_of(counts) ? its - all_of(counts) : all_of(counts) - its;
  }
  std::printf(
      "11 cameras, 640 x 480 at 15/s, %.0f s: %llu frames sent, %llu lost and counted, %llu unaccounted for; "
      "CPU %.2f %% of a core per camera\n",
      time.value(), static_cast<unsigned long long>(sent), static_cast<unsigned long long>(lost),
      static_cast<unsigned long long>(unaccounted), 100 * (cpu / time) / 11);
}

TEST_F(FilmTest, FramesThatTheNetworkTearsAreCountedByCauseAndNeverHandedOn) {
  const auto processes = fakes(2, "TORN", 2, 8);
  std::vector<std::unique_ptr<drivers::Camera>> cameras;
  for (const char* resend : {"never", "always"}) {
    drivers::CameraRequest request = small_film();
    request.size = ImageSize{320, 240};  // 55 packets: a third of the frames lack one
    request.frame_rate = Hertz(30);
    request.controls["PacketResend"] = resend;
    auto camera = driver.open(processes[cameras.size()]->serial(), request);
    ASSERT_TRUE(camera.ok()) << camera.error().message();
    cameras.push_back(std::move(camera).value());
  }
  std::vector<Film> films(2);
  {
    std::vector<std::jthread> owners;
    for (std::size_t i = 0; i < 2; ++i) {
      owners.emplace_back([&, i] {
        ASSERT_TRUE(cameras[i]->start().ok());
        films[i] = film_for(*cameras[i], Seconds(3));
        cameras[i]->stop();
      });
    }
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const auto sent = processes[i]->sent();
    const drivers::FrameCounts counts = cameras[i]->counts();
    const std::uint64_t torn = i == 0 ? counts.transport : counts.resend;
    ASSERT_GT(sent.incomplete.size(), 10U);
    EXPECT_EQ(films[i].wrong_pixels, 0U);
    EXPECT_EQ(films[i].wrong_number, 0U);
    EXPECT_EQ(films[i].damaged, 0U);
    EXPECT_EQ(films[i].frames, counts.delivered);
    EXPECT_EQ(counts.delivered + counts.passed_over, sent.frames.size() - sent.incomplete.size());
    EXPECT_EQ(torn, sent.incomplete.size());
    EXPECT_EQ(counts.lost(), torn);
    EXPECT_EQ(all_of(counts), sent.frames.size());
  }
}

TEST_F(FilmTest, WhoTakesNoFramesFindsTheOverflowCountedAsUnderrun) {
  const auto processes = fakes(1, "SLOW");
  drivers::CameraRequest request = small_film();
  request.size = ImageSize{64, 48};
  request.frame_rate = Hertz(100);
  auto camera = driver.open("SLOW1", request);
  ASSERT_TRUE(camera.ok()) << camera.error().message();
  ASSERT_TRUE((*camera)->start().ok());
  ASSERT_TRUE(test::wait_until([&] { return processes[0]->sent().frames.size() > 200; }));  // for 101 buffers
  const Film film = film_for(**camera, milliseconds(500));
  (*camera)->stop();
  const drivers::FrameCounts counts = (*camera)->counts();
  EXPECT_GT(counts.underrun, 50U);
  EXPECT_LE(counts.lost(), counts.underrun + 20);  // on a busy machine the kernel may lose some too
  EXPECT_EQ(film.skipped, counts.lost());
  EXPECT_EQ(film.wrong_number, 0U);
  EXPECT_EQ(all_of(counts), processes[0]->sent().frames.size());
}

TEST_F(FilmTest, AResetShowsTheNewCycleAndLosesNothing) {
  const auto processes = fakes(1, "RESET");
  auto camera = driver.open("RESET1", small_film());
  ASSERT_TRUE(camera.ok()) << camera.error().message();
  EXPECT_EQ((*camera)->info().reset, ShutterReset::on_command);
  ASSERT_TRUE((*camera)->start().ok());
  Film film = film_for(**camera, milliseconds(300));
  std::vector<double> latencies;
  for (int i = 0; i < asked_for("EMBERLOCK_ARAVIS_RESETS", 8); ++i) {
    const TimePoint at = clock.now() + milliseconds(20);
    const Status reset = (*camera)->reset_shutter(at);
    ASSERT_TRUE(reset.ok()) << reset.error().message();
    const auto frame = (*camera)->next_frame(Seconds(1));
    ASSERT_TRUE(frame.ok()) << frame.error().message();
    EXPECT_GT(frame->stamp.monotonic_time, at);
    EXPECT_EQ(frame->stamp.status, FrameStatus::complete);
    latencies.push_back(in_milliseconds(frame->stamp.monotonic_time - at));
    look_at(*frame, film);
  }
  (*camera)->stop();
  EXPECT_LE(film.skipped, (*camera)->counts().passed_over);
  EXPECT_EQ((*camera)->counts().lost(), 0U);
  EXPECT_EQ(film.wrong_number, 0U);
  EXPECT_EQ(all_of((*camera)->counts()), processes[0]->sent().frames.size());
  double mean = 0, square = 0;
  for (const double latency : latencies) mean += latency / static_cast<double>(latencies.size());
  for (const double latency : latencies) square += (latency - mean) * (latency - mean);
  std::printf("reset to the new cycle's first frame: %.1f ms, jitter %.1f ms RMS, %zu resets\n", mean,
              std::sqrt(square / static_cast<double>(latencies.size())), latencies.size());
  const auto too_early = (*camera)->reset_shutter(clock.now());
  EXPECT_FALSE(too_early.ok());  // it films no longer
}

}  // namespace
}  // namespace emberlock
