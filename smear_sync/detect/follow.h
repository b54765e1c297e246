// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "base/image.h"
#include "smear_sync/detect/detect.h"

namespace emberlock::smear {

/// Reads the frames of one camera in turn, in half of detect()'s time: once a lamp is found, only its columns
/// and a sparse sample of the rest are read. All of the frame is looked at again whenever anything but the
/// dots has changed (the lamp, its surroundings, the noise, the format), when a spot is as bright as a lamp,
/// and every 128th frame. So a new lamp elsewhere is noticed at once when it is 16 rows tall, within 16
/// frames when it is smaller. A saturated lamp that was measured while its dots stood elsewhere, and looks
/// as it did, is not measured again: its readings then share one error.
///
/// The result depends on the frames since construction and on nothing else. One for each camera; not for two
/// threads at once.
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
  std::unique_ptr<Known> known_;  ///< of the frame before
  unsigned turn_ = 0;
};

}  // namespace emberlock::smear
