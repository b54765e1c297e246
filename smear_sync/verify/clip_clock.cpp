// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/verify/clip_clock.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "smear_sync/verify/clip_line.h"
#include "smear_sync/verify/dark_direction.h"
#include "smear_sync/verify/median.h"

namespace emberlock::smear {
namespace {

constexpr PartsPerMillion kRateSigma{40};  // of a camera's clock relative to a strobe's, by specification
constexpr int kMostTurns = 4;

/// The lamp doesn't move. Its place is the median over all frames; each frame's dot is measured relative to
/// that, and a bright spot elsewhere (a dot whose lamp wasn't lit, a reflection) isn't the lamp. Its error is
/// common to all frames.
std::vector<FrameReading> with_one_lamp(const ClipReading& clip, Rows& lamp, Rows& lamp_sigma) {
  std::vector<FrameReading> frames;
  std::vector<double> rows;
  std::vector<double> sigmas;
  std::vector<double> columns;
  std::vector<double> radii;
  for (std::size_t i = 0; i < clip.frames.size(); ++i) {
    frames.push_back({static_cast<std::int64_t>(i), clip.frames[i]});
    if (const auto& seen = clip.frames[i].lamp) {
      rows.push_back(seen->y.value());
      sigmas.push_back(seen->sigma.value());
      columns.push_back(seen->x);
      radii.push_back(seen->radius);
    }
  }
  if (rows.empty()) return frames;
  lamp = Rows(median(rows));
  lamp_sigma = Rows(median(sigmas));
  const double column = median(columns);
  const double reach = median(radii) + 2;
  for (FrameReading& f : frames) {
    if (!f.reading.lamp) continue;
    if (std::hypot(f.reading.lamp->x - column, (f.reading.lamp->y - lamp).value()) <= reach) {
      f.reading.lamp->y = lamp;
      f.reading.lamp->sigma = Rows(0);
    } else {
      f.reading = {SmearState::no_lamp, {}, {}, "what shines isn't where the lamp is in the other frames"};
    }
  }
  return frames;
}

/// Frame rates that a file's claim may stand for: the claim itself, and usual rates that are often rounded to
/// it.
std::vector<Hertz> rates_to_try(const ClipReading& clip, const ClipOptions& options) {
  if (options.frame_rate) return {*options.frame_rate};
  constexpr std::array kInUse = {24000.0 / 1001,
                                 24.0,
                                 25.0,
                                 30000.0 / 1001,
                                 30.0,
                                 48.0,
                                 50.0,
                                 60000.0 / 1001,
                                 60.0,
                                 100.0,
                                 120000.0 / 1001,
                                 120.0,
                                 240000.0 / 1001,
                                 240.0};
  std::vector<Hertz> rates;
  if (clip.claimed_rate) rates.push_back(*clip.claimed_rate);
  const Hertz about = clip.claimed_rate.value_or(options.flash_rate);
  const double reach = clip.claimed_rate ? 0.0015 : 0.03;
  for (const double rate : kInUse) {
    const double off = std::abs(rate / about.value() - 1);
    if (off < reach && (!clip.claimed_rate || off > 1e-6)) rates.emplace_back(rate);
  }
  if (rates.empty()) rates.push_back(options.flash_rate);
  return rates;
}

std::vector<CodeFrame> flashes_seen(const std::vector<FrameReading>& frames) {
  std::vector<CodeFrame> seen;
  seen.reserve(frames.size());
  for (const FrameReading& f : frames) seen.push_back({f.frame, flash_seen(f.reading)});
  return seen;
}

bool same_losses(const FrameNumbers& a, const FrameNumbers& b) {
  return std::equal(a.drops.begin(), a.drops.end(), b.drops.begin(), b.drops.end(),
                    [](const DroppedFrames& x, const DroppedFrames& y) {
                      return x.after == y.after && x.before == y.before && x.frames == y.frames;
                    });
}

Status check(const ClipOptions& options) {
  const auto positive = [](double v) { return std::isfinite(v) && v > 0; };
  if (!positive(options.flash_rate.value()))
    return Error{ErrorKind::bad_input, "the flash rate isn't a positive number", "flash rate",
                 "give the strobe's rate in flashes a second"};
  if (!positive(options.row_time.value()))
    return Error{ErrorKind::bad_input, "the row time isn't a positive number", "row time",
                 "give it in microseconds, about 54 for a 720-row CCD, or film a comb"};
  return {};
}

}  // namespace

std::int64_t ClipClock::count_of(std::int64_t i) const {
  std::int64_t count = i;
  for (const DroppedFrames& drop : numbers.drops) {
    if (i >= drop.before) count += drop.frames;
  }
  return count;
}

Phase ClipClock::phase_of_frame(std::int64_t i) const {
  return phase_at(*line, TimePoint{} + believed_period * static_cast<double>(count_of(i)), flash_period);
}

const NumberedRun* ClipClock::run_at(std::int64_t i) const {
  const NumberedRun* nearest = nullptr;
  std::int64_t least = 0;
  for (const NumberedRun& run : numbers.runs) {
    const std::int64_t away = std::max({std::int64_t{0}, run.first - i, i - run.last});
    if (nearest == nullptr || away < least) {
      nearest = &run;
      least = away;
    }
  }
  return nearest;
}

Result<ClipWalk> read_walk(const ClipReading& clip, const ClipOptions& options) {
  std::vector<FrameReading> frames;
  for (std::size_t i = 0; i < clip.frames.size(); ++i)
    frames.push_back({static_cast<std::int64_t>(i), clip.frames[i]});
  std::optional<ClipWalk> first;
  for (const Hertz rate : rates_to_try(clip, options)) {
    const ReadModeOptions with{.flash_rate = options.flash_rate,
                               .frame_rate = rate,
                               .rate_sigma = kRateSigma,
                               .row_time = options.row_time,
                               .row_time_sigma = options.row_time_sigma,
                               .rows = clip.rows};
    EMBERLOCK_ASSIGN_OR_RETURN(ReadMode mode, find_read_mode(frames, with));
    if (mode.direction) return ClipWalk{rate, std::move(mode)};
    if (!first) first = ClipWalk{rate, std::move(mode)};
  }
  return std::move(*first);
}

Result<ClipClock> read_clip_clock(const ClipReading& clip, const ClipOptions& options) {
  EMBERLOCK_RETURN_IF_ERROR(check(options));
  ClipClock clock;
  clock.flash_period = period(options.flash_rate);
  const std::vector<FrameReading> frames = with_one_lamp(clip, clock.lamp, clock.lamp_sigma);
  for (const FrameReading& f : frames) clock.lit += f.reading.lamp ? 1 : 0;
  if (clip.claimed_rate && !options.frame_rate &&
      std::abs(clip.claimed_rate->value() / options.flash_rate.value() - 1) > 0.05) {
    clock.reason = fmt::format(
        "the file claims {:.3f} frames a second: flash the strobe about once a frame, or give --frame-rate",
        clip.claimed_rate->value());
    clock.believed_period = period(*clip.claimed_rate);  // for callers that place the clip by its sound
    clock.timing.rows = clock.timing.shifts = clip.rows;
    clock.timing.frame_period = clock.believed_period;
    return clock;
  }
  EMBERLOCK_ASSIGN_OR_RETURN(ClipWalk walk, read_walk(clip, options));
  clock.mode = std::move(walk.mode);
  if (!clock.direction_known(options)) {
    const DarkDirection dark = direction_by_dark_frames(frames);
    clock.mode.direction = dark.direction;
    if (dark.direction) clock.mode.direction_reason = dark.reason;
    if (!dark.direction && !dark.reason.empty()) clock.mode.direction_reason += "; " + dark.reason;
  }
  clock.believed_period = period(walk.frame_rate);
  const double off = clock.mode.frame_rate_error.value_or(PartsPerMillion(0)).value() * 1e-6;
  clock.timing = {
      .rows = clip.rows,
      .shifts = clip.rows,
      .frame_period = clock.believed_period / (1 + off),
      .row_time = options.row_time,
      .direction = clock.mode.direction.value_or(options.direction.value_or(ReadDirection::top_first))};

  // The code counts lost frames, which the line needs. The line gives the flash's position in the frame,
  // which the code needs if it is close to the frame's border. A few iterations make both consistent.
  const std::vector<CodeFrame> seen = flashes_seen(frames);
  for (const CodeFrame& f : seen) clock.seen.push_back(f.seen);
  DecodeOptions decode{.code = options.code,
                       .flashes_per_frame = clock.timing.frame_period / clock.flash_period};
  EMBERLOCK_ASSIGN_OR_RETURN(clock.numbers, number_frames(seen, decode));
  for (int turn = 0; turn < kMostTurns; ++turn) {
    find_line(frames, options, clock);
    if (!clock.line) break;
    decode.flashes_per_frame = clock.timing.frame_period / clock.flash_period;
    decode.first_phase = clock.phase_of_frame(0).tau / clock.flash_period;
    EMBERLOCK_ASSIGN_OR_RETURN(FrameNumbers numbers, number_frames(seen, decode));
    const bool agree = same_losses(numbers, clock.numbers);
    clock.numbers = std::move(numbers);
    if (agree) break;
  }
  return clock;
}

}  // namespace emberlock::smear
