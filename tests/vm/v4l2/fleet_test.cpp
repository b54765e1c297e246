// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <numeric>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "base/clock.h"
#include "drivers/camera_thread.h"
#include "tests/support/wait.h"
#include "tests/vm/v4l2/vivid.h"

// Eleven cameras at once, each on its thread as the daemon has them. EMBERLOCK_VM_SECONDS (3) is how long
// they film.
namespace emberlock {
namespace {

Seconds processor_time() {
  timespec used{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return Seconds(static_cast<double>(used.tv_sec)) + nanoseconds(static_cast<double>(used.tv_nsec));
}

class V4l2Fleet : public Vivid {
 protected:
  static constexpr int kCameras = 11;
  V4l2Fleet() : Vivid(kCameras) {}
  void TearDown() override { cameras_.clear(); }

  void film_all() {
    for (int i = 0; i < kCameras; ++i) {
      auto opened = drivers::v4l2_driver().open(id(i), small_gray());
      ASSERT_TRUE(opened.ok()) << opened.error().message();
      cameras_.push_back(std::make_unique<drivers::CameraThread>(std::move(opened).value()));
    }
    for (const auto& camera : cameras_) {
      const Status started = camera->start();
      ASSERT_TRUE(started.ok()) << started.error().message();
    }
  }
  /// Takes what camera `i` has until that instant. Its last frame's id, if there was one.
  std::optional<std::uint64_t> take(int i, TimePoint until) {
    std::optional<std::uint64_t> last;
    while (SteadyClock().now() < until) {
      const auto frame = cameras_[i]->next_frame(Seconds(0));
      if (!frame) break;
      last = frame->stamp.frame_id;
    }
    return last;
  }

  std::vector<std::unique_ptr<drivers::CameraThread>> cameras_;
};

TEST_F(V4l2Fleet, NoFrameIsUnaccountedForAndOneThatGoesLeavesTheOthersAlone) {
  film_all();
  const Seconds length(from_environment("EMBERLOCK_VM_SECONDS", 3));
  const TimePoint begin = SteadyClock().now();
  const Seconds used = processor_time();
  std::vector<std::uint64_t> last(kCameras);
  while (SteadyClock().now() < begin + length) {
    for (int i = 0; i < kCameras; ++i) last[i] = take(i, begin + length).value_or(last[i]);
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
  }
  const Seconds passed = SteadyClock().now() - begin;
  const double share = (processor_time() - used) / passed / kCameras;
  drivers::FrameCounts all;
  std::uint64_t unaccounted = 0;
  for (int i = 0; i < kCameras; ++i) {
    // What was on its way when the time was up.
    while (const auto frame = cameras_[i]->next_frame(milliseconds(500))) {
      last[i] = frame->stamp.frame_id;
      if (frame->stamp.monotonic_time > begin + length) break;
    }
    const drivers::FrameCounts counts = cameras_[i]->counts();
    const auto known = counts.delivered + counts.damaged + counts.lost() + counts.passed_over;
    // A gap is counted when the frame after it comes, which may wait in the queue.
    unaccounted += last[i] + 1 > known ? last[i] + 1 - known : 0;
    all.delivered += counts.delivered;
    all.damaged += counts.damaged;
    all.camera_gap += counts.camera_gap;
    all.underrun += counts.underrun;
    all.queue += counts.queue;
    EXPECT_GT(counts.delivered, 0.5 * Hertz(15) * length) << id(i);
  }
  std::printf(
      "11 vivid cameras, 640 x 360 gray8 at 15 frames/s for %.1f s: %lu whole, %lu damaged, %lu camera gaps, "
      "%lu underruns, "
      "%lu off the queue, %lu unaccounted for; %.2f %% of the emulated processor and 1 copy a camera and "
      "frame\n",
      passed.value(), all.delivered, all.damaged, all.camera_gap, all.underrun, all.queue, unaccounted,
      100 * share);
  EXPECT_EQ(unaccounted, 0U);
  EXPECT_EQ(all.damaged, 0U);

  Vivid::control(4, "Disconnect", "1");
  const TimePoint gone = SteadyClock().now();
  Result<Frame> next = Error{};
  do {
    next = cameras_[4]->next_frame(test::kHangGuard);
  } while (next.ok());
  EXPECT_EQ(next.error().kind, ErrorKind::device) << next.error().message();
  const Seconds report = SteadyClock().now() - gone;
  std::printf("one of 11 that went was reported after %.0f ms\n", in_milliseconds(report));
  EXPECT_EQ(cameras_[4]->state(), drivers::CameraThread::State::lost);
  for (int i = 0; i < kCameras; ++i) {
    if (i == 4) continue;
    const TimePoint now = SteadyClock().now();
    Result<Frame> frame = Error{};
    do {
      frame = cameras_[i]->next_frame(test::kHangGuard);
      ASSERT_TRUE(frame.ok()) << frame.error().message();
    } while (frame->stamp.monotonic_time < now);
    EXPECT_EQ(cameras_[i]->state(), drivers::CameraThread::State::filming);
  }
}

}  // namespace
}  // namespace emberlock
