// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>
#include <malloc.h>

#include "base/clock.h"
#include "drivers/camera_thread.h"
#include "tests/support/wait.h"
#include "tests/vm/v4l2/vivid.h"

// What is done again and again. EMBERLOCK_VM_ROUNDS (10) is how often the cameras are unplugged,
// EMBERLOCK_VM_RESETS (10) how often a shutter is reset.
namespace emberlock {
namespace {

class V4l2Again : public Vivid {
 protected:
  V4l2Again() : Vivid(2) {}
};

/// 0.99: what all but one in a hundred stay below.
double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

int open_descriptors() {
  int n = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd"))
    n += entry.path().empty() ? 0 : 1;
  return n;
}

/// What the program has asked for and not given back.
long heap_kilobytes() {
  const auto heap = ::mallinfo2();
  return static_cast<long>((heap.uordblks + heap.hblkhd) / 1024);
}

TEST_F(V4l2Again, AllComeBackEachTimeThatTheyAreUnpluggedWithoutALeak) {
  std::vector<std::unique_ptr<drivers::CameraThread>> cameras;
  for (int i = 0; i < 2; ++i) {
    cameras.push_back(
        std::make_unique<drivers::CameraThread>(drivers::v4l2_driver().open(id(i), small_gray()).value(),
                                                drivers::CameraThreadOptions{.queue_frames = 2}));
    ASSERT_TRUE(cameras.back()->start().ok());
  }
  const int rounds = from_environment("EMBERLOCK_VM_ROUNDS", 10);
  constexpr int kWarmUp = 3;  // rounds until allocators have what they keep
  std::vector<double> reports;
  std::vector<double> returns;
  int descriptors = 0;
  long memory = 0;
  for (int round = 0; round < rounds; ++round) {
    if (round == kWarmUp) {
      descriptors = open_descriptors();
      memory = heap_kilobytes();
    }
    unplug();
    TimePoint since = SteadyClock().now();
    for (const auto& camera : cameras) {
      Result<Frame> next = Error{};
      do {
        next = camera->next_frame(test::kHangGuard);
      } while (next.ok());
      ASSERT_EQ(next.error().kind, ErrorKind::device) << next.error().message();
    }
    reports.push_back((SteadyClock().now() - since).value());
    plug_in();
    since = SteadyClock().now();
    for (const auto& camera : cameras) {
      const auto next = camera->next_frame(test::kHangGuard);
      ASSERT_TRUE(next.ok()) << next.error().message();
    }
    returns.push_back((SteadyClock().now() - since).value());
  }
  const auto longest_report = *std::max_element(reports.begin(), reports.end());
  const auto longest_return = *std::max_element(returns.begin(), returns.end());
  // A camera that has just come back may still be looking at its device.
  static_cast<void>(test::wait_until([&] { return open_descriptors() <= descriptors; }));
  const int more_descriptors = open_descriptors() - descriptors;
  const long more_memory = heap_kilobytes() - memory;
  std::printf(
      "%d rounds of unplugging 2 vivid cameras: both reported %.0f ms after the kernel had removed them "
      "(median; longest %.0f), both "
      "filming %.0f ms "
      "after their return (median; longest %.0f); %+d descriptors, %+ld kB of heap after the first %d\n",
      rounds, 1e3 * quantile(reports, 0.5), 1e3 * longest_report, 1e3 * quantile(returns, 0.5),
      1e3 * longest_return, more_descriptors, more_memory, kWarmUp);
  if (rounds <= kWarmUp) return;
  EXPECT_LE(more_descriptors, 0);
  // One leaked picture of each camera and round would be twice that; two of each may wait in the queues.
  EXPECT_LE(more_memory, 225L * std::max(rounds - kWarmUp, 4));
}

TEST_F(V4l2Again, AResetsDelayIsKnownByTheTimestamps) {
  const auto camera = filming(id(0));
  ASSERT_NE(camera, nullptr);
  std::vector<double> delays;
  for (int i = 0; i < from_environment("EMBERLOCK_VM_RESETS", 10); ++i) {
    ASSERT_TRUE(camera->next_frame(test::kHangGuard).ok());
    const TimePoint at = SteadyClock().now() + milliseconds(20);
    ASSERT_TRUE(camera->reset_shutter(at).ok());
    const auto frame = camera->next_frame(test::kHangGuard);
    ASSERT_TRUE(frame.ok()) << frame.error().message();
    delays.push_back((frame->stamp.device_time - at).value());
    EXPECT_GT(delays.back(), 0);
  }
  const double n = static_cast<double>(delays.size());
  const double mean = std::accumulate(delays.begin(), delays.end(), 0.0) / n;
  double squares = 0;
  for (const double delay : delays) squares += (delay - mean) * (delay - mean);
  std::printf(
      "%zu resets of a vivid camera: its next frame's device time is %.2f ms after the moment asked for, "
      "jitter %.2f ms (one sigma)\n",
      delays.size(), 1e3 * mean, 1e3 * std::sqrt(squares / std::max(n - 1, 1.0)));
}

}  // namespace
}  // namespace emberlock
