// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "base/image.h"
#include "smear_sync/detect/detect.h"

namespace emberlock::smear {

/// Reads the frames of one camera in sequence, in half of detect()'s time: once a lamp is found, only its
/// columns and a sparse sample of the rest are read. The whole frame is scanned again when anything but the
/// dots has changed (the lamp, its surroundings, the noise, the format), when a spot is as bright as a lamp,
/// and every 128th frame. So a new lamp elsewhere is noticed at once if it is 16 rows tall, within 16 frames
/// if it is smaller. A saturated lamp that was measured clear of dots and looks the same is not measured
/// again; its readings then have a common error.
///
/// The result depends only on the frames since construction. Use one object per camera. Not thread-safe.
class FollowingDetector {
 public:
  explicit FollowingDetector(const DetectOptions& options = {});
  FollowingDetector(FollowingDetector&&) noexcept;
  FollowingDetector& operator=(FollowingDetector&&) noexcept;
  FollowingDetector(const FollowingDetector&) = delete;
  FollowingDetector& operator=(const FollowingDetector&) = delete;
  ~FollowingDetector();

  SmearReading read(const ImageView& frame);

 private:
  struct Known;
  DetectOptions options_;
  std::unique_ptr<Known> known_;  ///< from the previous frame
  unsigned turn_ = 0;
};

}  // namespace emberlock::smear
