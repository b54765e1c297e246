// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/verify/clip_times.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/square.h"

namespace emberlock::smear {

std::int64_t ClipTimes::count_of(std::int64_t place) const {
  std::int64_t count = place;
  for (const DroppedFrames& drop : drops) {
    if (place >= drop.before) count += drop.frames;
  }
  return count;
}

std::optional<std::int64_t> ClipTimes::place_of(std::int64_t count) const {
  std::int64_t place = count;
  for (const DroppedFrames& drop : drops) {
    if (place < drop.before) break;
    if (place < drop.before + drop.frames) return std::nullopt;
    place -= drop.frames;
  }
  return place;
}

Seconds ClipTimes::read_start(std::int64_t place) const {
  return start + period * (static_cast<double>(count_of(place)) - at);
}

Seconds ClipTimes::sigma(std::int64_t place) const {
  const double away = static_cast<double>(count_of(place)) - at;
  const double own = square(start_sigma.value()) - square(start_by_row_time.value()) +
                     square(away) * (square(period_sigma.value()) - square(period_by_row_time.value()));
  return Seconds(std::sqrt(std::max(0.0, own) + square(by_row_time(place).value())));
}

Seconds ClipTimes::by_row_time(std::int64_t place) const {
  return start_by_row_time + period_by_row_time * (static_cast<double>(count_of(place)) - at);
}

std::int64_t ClipTimes::nearest_count(Seconds instant) const {
  return std::llround(at + (instant - start) / period);
}

Seconds sigma_between(const ClipTimes& a, std::int64_t place_a, const ClipTimes& b, std::int64_t place_b) {
  const auto own = [](const ClipTimes& t, std::int64_t place) {
    return std::max(0.0, square(t.sigma(place).value()) - square(t.by_row_time(place).value()));
  };
  const Seconds shared = a.by_row_time(place_a) - b.by_row_time(place_b);
  return Seconds(std::sqrt(own(a, place_a) + own(b, place_b) + square(shared.value())));
}

ClipTimes strobe_times(const ClipClock& clock) {
  ClipTimes times;
  times.period = clock.timing.frame_period;
  times.period_sigma = clock.period_sigma;
  times.at = static_cast<double>(clock.line->at.ns) * 1e-9 / clock.believed_period.value();
  times.start_sigma = clock.line->tau_sigma;
  // Flashes are whole periods from a frame's own tau, not from that of an instant between two frames.
  const double frame = std::round(times.at);
  const Seconds tau = clock.line->tau + (clock.flash_period - times.period) * (frame - times.at);
  times.start = times.period * (times.at - frame) - tau;
  times.start_by_row_time = -1.0 * clock.line->tau_by_row_time;
  times.period_by_row_time = clock.believed_period * (-1e-6 * clock.line->rate_by_row_time.value());
  times.drops = clock.numbers.drops;
  return times;
}

Result<ClipTimes> known_strobe_times(const ClipClock& clock, const ClipOptions& options,
                                     const std::string& clip) {
  const auto unknown = [&](const std::string& what, const std::string& remedy) {
    return Error{ErrorKind::bad_input, what, clip, remedy};
  };
  if (clock.state != PhaseState::known || !clock.line) {
    return unknown("its strobe tells no phase: " + clock.reason,
                   "Film the strobe for ten seconds, the lamp in the picture, detuned by about 1 %");
  }
  if (!clock.direction_known(options)) {
    return unknown("which row is read first isn't known: " + clock.mode.direction_reason,
                   "Detune the strobe by about 1 %, or give --direction");
  }
  return strobe_times(clock);
}

Result<ClipTimes> clip_times(const ClipClock& clock, const ClipOptions& options, const std::string& clip) {
  EMBERLOCK_ASSIGN_OR_RETURN(ClipTimes times, known_strobe_times(clock, options, clip));
  const std::int64_t middle = std::llround(times.at);
  const NumberedRun* run = clock.run_at(middle);
  if (run == nullptr) {
    return Error{ErrorKind::bad_input, "its frames can't be numbered: " + clock.numbers.reason, clip,
                 "Let the strobe skip flashes in its code while all cameras film it"};
  }
  // The place in the run that is closest to the line's middle.
  std::int64_t place = middle - (clock.count_of(run->first) - run->first);
  place = std::clamp(place, run->first, run->last);
  const double coarse = run->start + static_cast<double>(place - run->first) * run->flashes_per_frame;
  times.start += clock.flash_period * std::round(coarse - times.read_start(place) / clock.flash_period);
  return times;
}

void into_cycle_of(const ClipTimes& reference, const ClipOptions& options, ClipTimes& times) {
  const Seconds cycle = period(options.flash_rate) * static_cast<double>(options.code.flashes());
  const Seconds apart = times.read_start(0) - reference.read_start(0);
  times.start -= cycle * std::round(apart / cycle);
}

}  // namespace emberlock::smear
