// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <utility>

#include "drivers/camera.h"

namespace emberlock::rig {

/// Passes on the calls to a camera owned by somebody else, and shows each frame to a callback.
class ObservedCamera final : public drivers::Camera {
 public:
  explicit ObservedCamera(drivers::Camera& camera, std::function<void(const Frame&)> on_frame = {})
      : camera_(camera), on_frame_(std::move(on_frame)) {}

  [[nodiscard]] bool filming() const { return filming_; }
  /// The end of the replayed recording was reached.
  [[nodiscard]] bool ended() const { return ended_; }
  [[nodiscard]] const drivers::CameraInfo& info() const override { return camera_.info(); }
  [[nodiscard]] drivers::FrameCounts counts() const override { return camera_.counts(); }
  Status start() override {
    EMBERLOCK_RETURN_IF_ERROR(camera_.start());
    filming_ = true;
    ended_ = false;
    return {};
  }
  void stop() override {
    filming_ = false;
    camera_.stop();
  }
  Result<Frame> next_frame(Seconds deadline) override {
    Result<Frame> frame = camera_.next_frame(deadline);
    if (frame && on_frame_) on_frame_(*frame);
    if (frame && sink_) sink_(*frame, counts());
    if (!frame && frame.error().kind == ErrorKind::out_of_data) {
      filming_ = false;
      ended_ = true;
    }
    return frame;
  }
  std::uint64_t pass_over(TimePoint until) override { return camera_.pass_over(until); }
  Status reset_shutter(TimePoint at) override { return camera_.reset_shutter(at); }
  Status trim_rate(PartsPerMillion trim) override { return camera_.trim_rate(trim); }
  /// As drivers::CameraThread::feed(), on the owner's thread: next_frame() hands the frame on, and returns it
  /// too.
  drivers::FrameCounts feed(drivers::FrameSink sink) {
    sink_ = std::move(sink);
    return counts();
  }

 private:
  drivers::Camera& camera_;
  std::function<void(const Frame&)> on_frame_;
  drivers::FrameSink sink_;
  bool filming_ = false;
  bool ended_ = false;
};

}  // namespace emberlock::rig
