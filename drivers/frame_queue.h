// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "drivers/camera.h"

namespace emberlock::drivers {

/// A camera's frames between its thread and whoever takes them: in a bounded queue, with the camera's errors
/// in their places, or at once to a sink. Counts what becomes of each. Not thread-safe.
class FrameQueue {
 public:
  explicit FrameQueue(std::size_t capacity) : capacity_(capacity) {}

  /// From now on frames go to `sink`, those that wait first; into the queue again where it is empty.
  /// `of_camera` here and below: what the camera itself counts.
  void feed(FrameSink sink, const FrameCounts& of_camera);
  /// Passes over what was filmed before the newest instant of pass_over(); loses the oldest of a full queue.
  void add(Frame frame, const FrameCounts& of_camera);
  void add(const Error& error) { waiting_.emplace_back(error); }
  /// Unless an error is the last that waits.
  void add_once(const Error& error) {
    if (waiting_.empty() || waiting_.back()) add(error);
  }
  /// Counts a frame that isn't queued.
  void pass_over() { ++own_.passed_over; }
  /// Drops what was filmed until then, and what comes of it later. Returns how many it dropped since the last
  /// call.
  std::uint64_t pass_over(TimePoint until);
  /// Drops the frames, and keeps the errors.
  void drop_frames();
  /// Drops the frames and the errors.
  void clear();
  /// The oldest frame or error; nothing where none waits.
  std::optional<Result<Frame>> take();
  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  /// The camera's counts, and what became of its frames here; those that wait are in none.
  [[nodiscard]] FrameCounts counts(const FrameCounts& of_camera) const;

 private:
  void count(const Frame& frame);

  const std::size_t capacity_;
  std::deque<Result<Frame>> waiting_;
  FrameSink sink_;
  FrameCounts own_;
  TimePoint wanted_from_;
  std::uint64_t unreported_ = 0;  ///< passed over since pass_over() returned
};

}  // namespace emberlock::drivers
