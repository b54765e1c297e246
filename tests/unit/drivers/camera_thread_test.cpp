// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera_thread.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <numeric>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/clock.h"
#include "tests/support/wait.h"

namespace emberlock::drivers {
namespace {

using test::kHangGuard;
using test::wait_until;
using ::testing::HasSubstr;
using State = CameraThread::State;

/// No call of a camera that works is late, however loaded the machine.
CameraThreadOptions quick(Seconds call_deadline = kHangGuard) {
  return {.queue_frames = 4, .retry = milliseconds(10), .call_deadline = call_deadline};
}

/// A device on a desk: a test plugs it in and out, has it make frames, and hang.
class Desk {
 public:
  std::atomic<bool> plugged{true};
  std::atomic<int> starts{0};
  std::atomic<int> stops{0};
  std::atomic<int> alive{0};
  std::atomic<double> trimmed{0};
  std::atomic<int> resets{0};
  std::atomic<std::int64_t> reset_at{0};
  std::atomic<bool> refuses_resets{false};
  std::atomic<bool> ended{false};  ///< as a recording, behind the frames that were made

  void make_frames(int count) {
    const std::lock_guard lock(mutex_);
    made_ += count;
  }
  std::optional<std::uint64_t> take() {
    const std::lock_guard lock(mutex_);
    if (taken_ == made_) return {};
    return taken_++;
  }
  bool all_taken() {
    const std::lock_guard lock(mutex_);
    return taken_ == made_;
  }
  std::atomic<bool> computes{false};  ///< next_frame doesn't come to an end for want of a faster processor
  void hang() { set(true); }
  void go_on() { set(false); }
  void pass_hang() {
    std::unique_lock lock(mutex_);
    free_.wait(lock, [this] { return !hanging_; });
  }

 private:
  void set(bool hanging) {
    const std::lock_guard lock(mutex_);
    hanging_ = hanging;
    free_.notify_all();
  }
  std::mutex mutex_;
  std::condition_variable free_;
  std::uint64_t made_ = 0;
  std::uint64_t taken_ = 0;
  bool hanging_ = false;
};

class DeskCamera final : public Camera {
 public:
  explicit DeskCamera(std::shared_ptr<Desk> desk, ShutterReset reset = ShutterReset::on_command)
      : desk_(std::move(desk)) {
    info_.id = "c7";
    info_.reset = reset;
    ++desk_->alive;
  }
  ~DeskCamera() override { --desk_->alive; }
  DeskCamera(const DeskCamera&) = delete;
  DeskCamera& operator=(const DeskCamera&) = delete;

  const CameraInfo& info() const override { return info_; }
  FrameCounts counts() const override { return counts_; }
  Status start() override {
    if (!desk_->plugged) return Error{ErrorKind::device, "it isn't there", "camera c7", {}};
    ++desk_->starts;
    filming_ = true;
    return {};
  }
  void stop() override {
    ++desk_->stops;
    filming_ = false;
  }
  Result<Frame> next_frame(Seconds deadline) override {
    desk_->pass_hang();
    while (desk_->computes) {
    }
    if (!filming_) return Error{ErrorKind::device, "it does not film", "camera c7", {}};
    if (!desk_->plugged) {
      filming_ = false;
      return Error{ErrorKind::device, "it was unplugged", "camera c7", {}};
    }
    if (const auto id = desk_->take()) {
      ++counts_.delivered;
      Frame frame;
      frame.stamp.frame_id = *id;
      frame.stamp.monotonic_time = SteadyClock().now();
      return frame;
    }
    if (desk_->ended) return Error{ErrorKind::out_of_data, "the recording has ended", "camera c7", {}};
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(deadline.value(), .001)));
    return Error{ErrorKind::timed_out, "no frame", "camera c7", {}};
  }
  std::uint64_t pass_over(TimePoint /*until*/) override { return 0; }
  Status reset_shutter(TimePoint at) override {
    SteadyClock().sleep_until(at);
    desk_->reset_at = SteadyClock().now().ns;
    ++desk_->resets;
    if (desk_->refuses_resets) return Error{ErrorKind::device, "it refuses the reset", "camera c7", {}};
    if (!desk_->plugged) return Error{ErrorKind::device, "it was unplugged", "camera c7", {}};
    return {};
  }
  Status trim_rate(PartsPerMillion trim) override {
    desk_->trimmed = trim.value();
    return {};
  }

 private:
  std::shared_ptr<Desk> desk_;
  CameraInfo info_;
  FrameCounts counts_;
  bool filming_ = false;
};

struct CameraThreads : ::testing::Test {
  explicit CameraThreads(Seconds call_deadline = kHangGuard)
      : camera(std::make_unique<CameraThread>(std::make_unique<DeskCamera>(desk), quick(call_deadline))) {}
  std::shared_ptr<Desk> desk = std::make_shared<Desk>();
  std::unique_ptr<CameraThread> camera;
};

/// A camera whose calls are soon late.
struct HangingCameraThreads : CameraThreads {
  explicit HangingCameraThreads(Seconds call_deadline = milliseconds(200)) : CameraThreads(call_deadline) {
    start();
  }
  /// On a loaded machine the thread may be late itself.
  void start() {
    ASSERT_TRUE(wait_until([&] { return camera->start().ok(); }));
  }
};
struct BusyCameraThreads : HangingCameraThreads {
  BusyCameraThreads() : HangingCameraThreads(milliseconds(500)) {}
};

TEST_F(CameraThreads, ARecordingThatEndsGivesItsFramesAndThenSaysSoEachTime) {
  desk->make_frames(3);
  desk->ended = true;
  ASSERT_TRUE(camera->start().ok());
  ASSERT_TRUE(wait_until([&] { return camera->state() == State::ended; }));
  for (std::uint64_t id = 0; id < 3; ++id) EXPECT_EQ(camera->next_frame(kHangGuard)->stamp.frame_id, id);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(camera->next_frame(Seconds(0)).error().kind, ErrorKind::out_of_data);
  desk->ended = false;
  ASSERT_TRUE(camera->start().ok());
  EXPECT_EQ(camera->state(), State::filming);
  camera->stop();
  EXPECT_EQ(camera->state(), State::idle);
}

TEST_F(CameraThreads, FramesComeInOrderAndAreCountedAsTheyAreTaken) {
  ASSERT_TRUE(camera->start().ok());
  desk->make_frames(3);
  for (std::uint64_t id = 0; id < 3; ++id) EXPECT_EQ(camera->next_frame(kHangGuard)->stamp.frame_id, id);
  EXPECT_EQ(camera->counts(), (FrameCounts{.delivered = 3}));
  const auto none = camera->next_frame(milliseconds(5));
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().kind, ErrorKind::timed_out);
}

TEST_F(CameraThreads, AFullQueueLosesItsOldestAndCountsThem) {
  ASSERT_TRUE(camera->start().ok());
  desk->make_frames(10);
  ASSERT_TRUE(wait_until([&] { return camera->counts().queue == 6; }));
  for (std::uint64_t id = 6; id < 10; ++id) EXPECT_EQ(camera->next_frame(kHangGuard)->stamp.frame_id, id);
  EXPECT_EQ(camera->counts(), (FrameCounts{.delivered = 4, .queue = 6}));
}

TEST_F(CameraThreads, ASinkTakesEachFrameOnceAndTheQueueTheOthers) {
  ASSERT_TRUE(camera->start().ok());
  std::mutex mutex;
  std::vector<std::uint64_t> taken;
  const auto sink = [&](const Frame& frame, const FrameCounts& counts) {
    const std::lock_guard lock(mutex);
    taken.push_back(frame.stamp.frame_id);
    EXPECT_EQ(counts.delivered, taken.size());
  };
  desk->make_frames(2);
  ASSERT_TRUE(wait_until([&] { return desk->all_taken(); }));
  EXPECT_EQ(camera->feed(sink).delivered, 0U) << "what waits is delivered after that";
  desk->make_frames(100);  // a queue of four would lose most of them
  ASSERT_TRUE(wait_until([&] { return camera->counts().delivered == 102; }));
  EXPECT_EQ(camera->feed({}).delivered, 102U);
  desk->make_frames(1);
  EXPECT_EQ(camera->next_frame(kHangGuard)->stamp.frame_id, 102U);
  std::vector<std::uint64_t> all(102);
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(taken, all);
  EXPECT_EQ(camera->counts(), (FrameCounts{.delivered = 103}));
}

TEST_F(CameraThreads, ACameraThatWentAwayIsSaidOnceAndFilmsOnWhenItIsBack) {
  ASSERT_TRUE(camera->start().ok());
  desk->plugged = false;
  EXPECT_EQ(camera->next_frame(kHangGuard).error().kind, ErrorKind::device);
  EXPECT_EQ(camera->state(), State::lost);
  const auto away = camera->next_frame(milliseconds(30));
  ASSERT_FALSE(away.ok());
  EXPECT_EQ(away.error().kind, ErrorKind::timed_out);
  EXPECT_THAT(away.error().message(), HasSubstr("it has been away"));
  desk->make_frames(1);
  desk->plugged = true;
  ASSERT_TRUE(camera->next_frame(kHangGuard).ok());
  EXPECT_EQ(camera->state(), State::filming);
  EXPECT_EQ(desk->starts, 2);
}

TEST_F(CameraThreads, StoppedWhileItIsAwayItIsNotLookedForAnyMore) {
  ASSERT_TRUE(camera->start().ok());
  desk->plugged = false;
  EXPECT_EQ(camera->next_frame(kHangGuard).error().kind, ErrorKind::device);
  camera->stop();
  desk->plugged = true;
  const TimePoint enough = SteadyClock().now() + 6 * quick().retry;
  do {  // what it does instead of searching
    ASSERT_TRUE(camera->trim_rate(PartsPerMillion(1)).ok());
  } while (SteadyClock().now() < enough);
  EXPECT_EQ(desk->starts, 1);
  EXPECT_EQ(camera->state(), State::idle);
}

TEST_F(HangingCameraThreads, OneThatHangsIsQuarantinedUntilItGoesOn) {
  desk->hang();
  const TimePoint began = SteadyClock().now();
  const auto hanging = camera->next_frame(2 * kHangGuard);
  ASSERT_FALSE(hanging.ok());
  EXPECT_EQ(hanging.error().kind, ErrorKind::device);
  EXPECT_THAT(hanging.error().message(), HasSubstr("camera c7: it hangs"));
  EXPECT_THAT(hanging.error().message(), HasSubstr("in next_frame"));
  EXPECT_LT(SteadyClock().now() - began, kHangGuard) << "long before the deadline";
  EXPECT_EQ(camera->state(), State::quarantined);
  EXPECT_EQ(camera->trim_rate(PartsPerMillion(3)).error().kind, ErrorKind::device);
  desk->make_frames(1);
  desk->go_on();
  ASSERT_TRUE(wait_until([&] { return camera->state() == State::filming; }));
  EXPECT_TRUE(camera->next_frame(kHangGuard).ok());
}

TEST_F(BusyCameraThreads, OneThatComputesForTooLongDoesNotHang) {
  desk->computes = true;
  ASSERT_TRUE(wait_until([&] { return camera->overworked(); }));
  EXPECT_EQ(camera->state(), State::filming);
  EXPECT_FALSE(camera->trouble());
  EXPECT_EQ(camera->next_frame(milliseconds(30)).error().kind, ErrorKind::timed_out);
  desk->computes = false;
  ASSERT_TRUE(wait_until([&] { return !camera->overworked(); }));
  desk->make_frames(1);
  EXPECT_TRUE(camera->next_frame(kHangGuard).ok());
}

TEST_F(HangingCameraThreads, OneThatHangsForGoodIsLeftBehindInBoundedTime) {
  desk->hang();
  EXPECT_FALSE(camera->next_frame(kHangGuard).ok());
  const TimePoint began = SteadyClock().now();
  camera->stop();
  camera.reset();
  EXPECT_LT(SteadyClock().now() - began, kHangGuard);
  EXPECT_EQ(desk->alive, 1);
  desk->go_on();
  ASSERT_TRUE(wait_until([&] { return desk->alive == 0; }));
}

TEST_F(CameraThreads, AResetReturnsBeforeItsInstantAndNoFrameOfTheOldPhaseIsHandedOn) {
  ASSERT_TRUE(camera->start().ok());
  desk->make_frames(2);
  EXPECT_TRUE(camera->next_frame(kHangGuard).ok());
  const TimePoint never = SteadyClock().now() + 2 * kHangGuard;
  ASSERT_TRUE(camera->reset_shutter(never).ok());
  EXPECT_LT(SteadyClock().now(), never);
  desk->make_frames(3);  // before the instant
  ASSERT_TRUE(wait_until([&] { return camera->counts().passed_over == 4; }));
  EXPECT_EQ(desk->resets, 0);
  camera->stop();
  ASSERT_TRUE(camera->start().ok());
  const TimePoint at = SteadyClock().now() + milliseconds(50);
  ASSERT_TRUE(camera->reset_shutter(at).ok());
  ASSERT_TRUE(wait_until([&] { return desk->resets == 1; }));
  EXPECT_GE(desk->reset_at.load(), at.ns);
  EXPECT_TRUE(wait_until([&] {
    desk->make_frames(1);
    return camera->next_frame(milliseconds(20)).ok();
  }));
  const FrameCounts counts = camera->counts();
  EXPECT_EQ(counts.delivered, 2);
  EXPECT_GE(counts.passed_over, 4);
}

TEST_F(CameraThreads, OthersAreHeardWhileAResetWaitsForItsInstant) {
  ASSERT_TRUE(camera->start().ok());
  ASSERT_TRUE(camera->reset_shutter(SteadyClock().now() + 2 * kHangGuard).ok());
  EXPECT_TRUE(camera->trim_rate(PartsPerMillion(7)).ok());
  EXPECT_EQ(desk->trimmed, 7);
  camera->stop();
  EXPECT_EQ(desk->stops, 1);
  EXPECT_EQ(camera->state(), State::idle);
  ASSERT_TRUE(camera->start().ok());
  desk->make_frames(1);
  EXPECT_TRUE(camera->next_frame(kHangGuard).ok());
  EXPECT_EQ(desk->resets, 0);
}

TEST_F(CameraThreads, AResetThatFailsIsSaidOnceByTheNextFrame) {
  ASSERT_TRUE(camera->start().ok());
  desk->refuses_resets = true;
  ASSERT_TRUE(camera->reset_shutter(SteadyClock().now()).ok());
  EXPECT_THAT(camera->next_frame(kHangGuard).error().message(), HasSubstr("it refuses the reset"));
  const auto next = camera->next_frame(milliseconds(30));
  EXPECT_TRUE(next.ok() || next.error().kind == ErrorKind::timed_out) << next.error().message();
}

TEST_F(CameraThreads, WhatIsAwayCannotBeReset) {
  ASSERT_TRUE(camera->start().ok());
  desk->plugged = false;
  EXPECT_EQ(camera->next_frame(kHangGuard).error().kind, ErrorKind::device);
  EXPECT_EQ(camera->reset_shutter({}).error().kind, ErrorKind::timed_out);
}

TEST_F(HangingCameraThreads, StoppedWhileItHangsItIsStoppedWhenItGoesOn) {
  desk->hang();
  EXPECT_FALSE(camera->next_frame(kHangGuard).ok());
  camera->stop();
  EXPECT_EQ(desk->stops, 0);
  desk->make_frames(1);
  desk->go_on();
  ASSERT_TRUE(wait_until([&] { return desk->stops == 1; }));
  EXPECT_EQ(camera->state(), State::idle);
  start();
  EXPECT_EQ(camera->next_frame(milliseconds(20)).error().kind, ErrorKind::timed_out)
      << "frame 0 was passed over";
  EXPECT_EQ(camera->counts().passed_over, 1);
}

TEST_F(CameraThreads, AShutterThatCannotBeResetIsRefusedAtOnce) {
  CameraThread fixed(std::make_unique<DeskCamera>(desk, ShutterReset::none), quick());
  ASSERT_TRUE(fixed.start().ok());
  EXPECT_THAT(fixed.reset_shutter({}).error().message(), HasSubstr("can't be reset"));
}

TEST_F(CameraThreads, FramesPassedOverAreSaidAndCounted) {
  ASSERT_TRUE(camera->start().ok());
  desk->make_frames(3);
  std::uint64_t passed = 0;
  ASSERT_TRUE(wait_until([&] { return (passed += camera->pass_over(SteadyClock().now())) == 3; }));
  desk->make_frames(1);
  EXPECT_EQ(camera->next_frame(kHangGuard)->stamp.frame_id, 3);
  EXPECT_EQ(camera->counts(), (FrameCounts{.delivered = 1, .passed_over = 3}));
}

TEST_F(CameraThreads, StopDropsWhatWaits) {
  ASSERT_TRUE(camera->start().ok());
  desk->make_frames(6);
  ASSERT_TRUE(wait_until([&] { return camera->counts().queue == 2; }));  // all six have come, four wait
  camera->stop();
  EXPECT_EQ(desk->stops, 1);
  EXPECT_EQ(camera->counts(), (FrameCounts{.queue = 2, .passed_over = 4}));
  EXPECT_EQ(camera->next_frame(milliseconds(5)).error().kind, ErrorKind::device);
  ASSERT_TRUE(camera->start().ok());
  desk->make_frames(1);
  EXPECT_EQ(camera->next_frame(kHangGuard)->stamp.frame_id, 6);
}

TEST_F(CameraThreads, TrimsReachTheCamera) {
  ASSERT_TRUE(camera->trim_rate(PartsPerMillion(12)).ok());
  EXPECT_EQ(desk->trimmed, 12);
}

TEST_F(CameraThreads, ACameraThatIsNotThereRefusesToStart) {
  desk->plugged = false;
  EXPECT_EQ(camera->start().error().kind, ErrorKind::device);
  EXPECT_EQ(camera->state(), State::idle);
}

}  // namespace
}  // namespace emberlock::drivers
