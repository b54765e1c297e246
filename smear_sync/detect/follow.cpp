// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/follow.h"

#include "smear_sync/detect/judge.h"
#include "smear_sync/detect/look.h"

namespace emberlock::smear {
namespace {

bool shows_dots(const SmearReading& reading) {
  return reading.state == SmearState::dot || reading.state == SmearState::comb;
}

}  // namespace

struct FollowingDetector::Known {
  ImageLayout layout;
  detail::Look look;
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
  constexpr unsigned kWholeLook = 128;  // frames: a few seconds
  const unsigned turn = turn_++;
  if (known_ && known_->layout == frame.layout && turn % kWholeLook != 0) {
    if (std::optional<detail::Look> look = detail::look_again(plane, known_->look, turn, options_)) {
      SmearReading reading = detail::read_lamps(plane, look->background, look->search, options_);
      known_->look = std::move(*look);
      known_->look.clear_of_dots |= shows_dots(reading);
      return reading;
    }
  }
  detail::Look look = detail::whole_look(plane, options_);
  SmearReading reading = detail::read_lamps(plane, look.background, look.search, options_);
  look.clear_of_dots = shows_dots(reading);
  known_ = std::make_unique<Known>(Known{frame.layout, std::move(look)});
  return reading;
}

}  // namespace emberlock::smear
