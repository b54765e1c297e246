// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/follow.h"

#include "smear_sync/detect/classify.h"
#include "smear_sync/detect/frame_scan.h"

namespace emberlock::smear {
namespace {

bool shows_dots(const SmearReading& reading) {
  return reading.state == SmearState::dot || reading.state == SmearState::comb;
}

}  // namespace

struct FollowingDetector::Known {
  ImageLayout layout;
  detail::FrameScan scan;
};

FollowingDetector::FollowingDetector(const DetectOptions& options) : options_(options) {}
FollowingDetector::FollowingDetector(FollowingDetector&&) noexcept = default;
FollowingDetector& FollowingDetector::operator=(FollowingDetector&&) noexcept = default;
FollowingDetector::~FollowingDetector() = default;

SmearReading FollowingDetector::read(const ImageView& frame) {
  if (const std::string why = detail::unreadable(frame); !why.empty()) {
    known_.reset();
    return detail::nothing(why);
  }
  const detail::Plane plane = detail::to_plane(frame);
  constexpr unsigned kFullScan = 128;  // frames: a few seconds
  const unsigned turn = turn_++;
  if (known_ && known_->layout == frame.layout && turn % kFullScan != 0) {
    if (std::optional<detail::FrameScan> scan = detail::rescan(plane, known_->scan, turn, options_)) {
      SmearReading reading = detail::read_lamps(plane, scan->background, scan->search, options_);
      known_->scan = std::move(*scan);
      known_->scan.clear_of_dots |= shows_dots(reading);
      return reading;
    }
  }
  detail::FrameScan scan = detail::scan_frame(plane, options_);
  SmearReading reading = detail::read_lamps(plane, scan.background, scan.search, options_);
  scan.clear_of_dots = shows_dots(reading);
  known_ = std::make_unique<Known>(Known{frame.layout, std::move(scan)});
  return reading;
}

}  // namespace emberlock::smear
