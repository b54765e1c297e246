// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/ccd_model.h"

#include <algorithm>
#include <cmath>

namespace emberlock::smear {
namespace {

/// Relative rounding tolerance for K t_row <= T.
constexpr double kFullReadTolerance = 1e-9;

Error bad_timing(std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), "CCD timing", std::move(remedy)};
}

/// An interval in which the register doesn't move.
struct Standstill {
  int frame;
  int shifts;  // K: the rest
};

Seconds end_of(const CcdTiming& timing, Standstill s) {
  if (s.shifts >= timing.shifts) return timing.frame_period * (s.frame + 1.0);
  return timing.frame_period * static_cast<double>(s.frame) + Rows(s.shifts + 1.0) * timing.row_time;
}

Standstill standstill_at(const CcdTiming& timing, Seconds t) {
  const double frame = std::floor(t / timing.frame_period);
  const Seconds tau = t - timing.frame_period * frame;
  const double k = std::floor((tau / timing.row_time).value());
  return {static_cast<int>(frame), static_cast<int>(std::clamp(k, 0.0, double(timing.shifts)))};
}

Standstill next(const CcdTiming& timing, Standstill s) {
  return s.shifts < timing.shifts ? Standstill{s.frame, s.shifts + 1} : Standstill{s.frame + 1, 0};
}

/// Converts a displayed row to its place in read order, and back (an involution).
int read_order(const CcdTiming& timing, int row) {
  return timing.direction == ReadDirection::top_first ? row : timing.rows - 1 - row;
}
Rows read_order(const CcdTiming& timing, Rows row) {
  return timing.direction == ReadDirection::top_first ? row : Rows(timing.rows - 1.0) - row;
}

}  // namespace

Status check(const CcdTiming& timing) {
  if (timing.rows <= 0) {
    return bad_timing("rows is " + std::to_string(timing.rows), "give at least 1 visible row");
  }
  if (timing.shifts < timing.rows) {
    return bad_timing("shifts is " + std::to_string(timing.shifts) + ", fewer than the visible rows",
                      "give K between " + std::to_string(timing.rows) + " and T / t_row");
  }
  const double period = timing.frame_period.value();
  const double row_time = timing.row_time.value();
  if (!std::isfinite(period) || !std::isfinite(row_time) || period <= 0 || row_time <= 0) {
    return bad_timing("the frame period or the row time is not a positive number",
                      "give both in seconds, for example 1/23.976 and 54e-6");
  }
  if (timing.shifts * row_time > period * (1 + kFullReadTolerance)) {
    return bad_timing("reading " + std::to_string(timing.shifts) + " rows takes longer than a frame",
                      "lower K to at most " + std::to_string(static_cast<long long>(period / row_time)));
  }
  return {};
}

std::vector<FlashPart> split(const CcdTiming& timing, Flash flash) {
  const Seconds begin = flash.centre - flash.width / 2;
  const Seconds end = flash.centre + flash.width / 2;
  Standstill at = standstill_at(timing, begin);
  std::vector<FlashPart> parts;
  Seconds from = begin;
  // Intervals are enumerated by counting, not computed from the time, so rounding at a border can't stall the
  // loop.
  for (; from < end; at = next(timing, at)) {
    const Seconds to = std::min(end, end_of(timing, at));
    if (to <= from) continue;
    parts.push_back({at.frame, at.shifts, (to - from) / flash.width});
    from = to;
  }
  if (parts.empty()) parts.push_back({at.frame, at.shifts, 1});
  return parts;
}

std::optional<Landing> landing(const CcdTiming& timing, int row, const FlashPart& part, SweepOut sweep_out) {
  const bool rest = part.shifts >= timing.shifts;
  const int packet = read_order(timing, row) + (rest ? timing.shifts : part.shifts);
  if (packet < timing.rows) return Landing{part.frame, read_order(timing, packet)};
  if (packet < timing.shifts || sweep_out == SweepOut::before_transfer) return std::nullopt;
  return Landing{part.frame + 1, read_order(timing, packet - timing.shifts)};
}

std::vector<SmearDeposit> smear_deposits(const CcdTiming& timing, int row, Flash flash, SweepOut sweep_out) {
  std::vector<SmearDeposit> deposits;
  for (const FlashPart& part : split(timing, flash)) {
    const auto at = landing(timing, row, part, sweep_out);
    if (!at) continue;
    if (!deposits.empty() && Landing{deposits.back().image, deposits.back().row} == *at) {
      deposits.back().fraction +=
          part.fraction;  // rest, then the next frame's k = 0: the lamp's own row, twice
    } else {
      deposits.push_back({at->image, at->row, part.fraction});
    }
  }
  return deposits;
}

std::optional<SmearCentre> smear_centre(const CcdTiming& timing, Rows lamp, const FlashPart& part,
                                        SweepOut sweep_out) {
  const Rows packet = read_order(timing, lamp) + Rows(std::min(part.shifts, timing.shifts));
  const Rows half(0.5);  // a packet extends half a row to each side of its centre
  if (packet + half < Rows(timing.rows)) return SmearCentre{part.frame, read_order(timing, packet)};
  if (packet + half < Rows(timing.shifts) || sweep_out == SweepOut::before_transfer) return std::nullopt;
  return SmearCentre{part.frame + 1, read_order(timing, packet - Rows(timing.shifts))};
}

Rows shifts_between(const CcdTiming& timing, Rows lamp, Rows dot) {
  return wrap_positive((dot - lamp) * static_cast<double>(timing.direction), Rows(timing.shifts));
}

}  // namespace emberlock::smear
