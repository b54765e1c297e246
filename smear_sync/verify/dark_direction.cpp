// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/verify/dark_direction.h"

#include <cmath>
#include <cstddef>
#include <vector>

#include <fmt/format.h>

#include "smear_sync/clocks/frame_code.h"

namespace emberlock::smear {
namespace {

constexpr double kOdds = 7;       // log: 1000 to 1
constexpr double kStray = 0.05;   // probability that a frame shows a false dot or is misread
constexpr std::size_t kNear = 8;  // distance in frames within which a neighbour shows where a dot would be

class DarkEnds {
 public:
  explicit DarkEnds(std::span<const FrameReading> frames) : frames_(frames) {}

  /// Counts dots at both ends of lit intervals.
  void count() {
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const SmearState state = frames_[i].reading.state;
      if (state != SmearState::dot && state != SmearState::no_dot) continue;
      const bool first = dark(i, -1);
      const bool last = dark(i, +1);
      const int side = side_near(i);
      if (first == last || side == 0) continue;
      const bool has_dot = state == SmearState::dot;
      if (first) {
        ++begun_;
        begun_with_dot_ += has_dot ? 1 : 0;
      } else {
        ends_.push_back({side, has_dot});
      }
    }
  }

  [[nodiscard]] DarkDirection conclude() const {
    DarkDirection told;
    if (ends_.empty()) return told;
    const double when_wrapped = (1 - kStray) * (begun_with_dot_ + 1) / (begun_ + 2);
    double odds = 0;  // log-odds of the top row being read first
    int with_dot = 0;
    for (const End& end : ends_) {
      const double wrapped =
          end.has_dot ? std::log(when_wrapped / kStray) : std::log((1 - when_wrapped) / (1 - kStray));
      odds -= end.side * wrapped;  // a wrapped dot below the lamp: the bottom row is read first
      with_dot += end.has_dot ? 1 : 0;
    }
    const std::string seen =
        fmt::format("{} of {} frames before a dark one show a dot", with_dot, ends_.size());
    if (std::abs(odds) < kOdds) {
      told.reason = seen + ", which tells too little";
      return told;
    }
    told.direction = odds > 0 ? ReadDirection::top_first : ReadDirection::bottom_first;
    told.reason = fmt::format("{}, as with the {} row read first", seen, odds > 0 ? "top" : "bottom");
    return told;
  }

 private:
  struct End {
    int side;  ///< side of the lamp where its dot is or would be: +1 is below
    bool has_dot;
  };

  /// Whether the neighbouring frame (which must exist) isn't lit.
  [[nodiscard]] bool dark(std::size_t i, int step) const {
    if ((step < 0 && i == 0) || (step > 0 && i + 1 == frames_.size())) return false;
    const FrameReading& next = frames_[step < 0 ? i - 1 : i + 1];
    return next.frame == frames_[i].frame + step && flash_seen(next.reading) == FlashSeen::no;
  }
  [[nodiscard]] static int side_of(const SmearReading& reading) {
    if (reading.state != SmearState::dot || reading.dots.size() != 1 || !reading.lamp) return 0;
    return reading.dots.front().y > reading.lamp->y ? 1 : -1;
  }
  /// The side of the dots in the frames around it, if they agree; else 0.
  [[nodiscard]] int side_near(std::size_t i) const {
    int side = 0;
    for (std::size_t k = i > kNear ? i - kNear : 0; k < frames_.size() && k <= i + kNear; ++k) {
      const int of = k == i ? 0 : side_of(frames_[k].reading);
      if (of == 0) continue;
      if (side != 0 && of != side) return 0;
      side = of;
    }
    const int own = side_of(frames_[i].reading);
    return own != 0 && own != side ? 0 : side;
  }

  std::span<const FrameReading> frames_;
  std::vector<End> ends_;
  int begun_ = 0, begun_with_dot_ = 0;
};

}  // namespace

DarkDirection direction_by_dark_frames(std::span<const FrameReading> frames) {
  DarkEnds ends(frames);
  ends.count();
  return ends.conclude();
}

}  // namespace emberlock::smear
