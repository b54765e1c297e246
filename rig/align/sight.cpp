// SPDX-License-Identifier: Apache-2.0
#include "rig/align/sight.h"

#include <algorithm>
#include <cmath>

#include "smear_sync/ccd_model.h"

namespace emberlock::rig {
namespace {

/// Where the dot of a flash that comes at tau stands, if it is displayed.
std::optional<Rows> dot_row(const smear::CcdTiming& timing, Rows lamp, Seconds tau) {
  // A flash in the middle of a row period moves its dot by the rows shifted before.
  const double shifted = (tau / timing.row_time).value() - 0.5;
  const double whole = std::max(0.0, std::floor(shifted));
  if (whole >= timing.shifts) return std::nullopt;  // the register rests
  const auto centre = smear::smear_centre(timing, lamp, {0, static_cast<int>(whole), 1});
  if (!centre) return std::nullopt;
  return centre->row + static_cast<double>(timing.direction) * Rows(shifted - whole);
}

/// Where the dots of flashes show that come within `tolerance` of the target.
std::vector<RowSpan> band(const smear::CcdTiming& timing, Rows lamp, Seconds target, Seconds tolerance) {
  const Rows half(0.5);
  std::vector<RowSpan> spans;
  std::optional<Rows> before;
  for (int shift = 0; shift < timing.shifts; ++shift) {
    const Seconds tau = Rows(shift + 0.5) * timing.row_time;
    if (abs(wrap_symmetric(tau - target, timing.frame_period)) > tolerance) continue;
    const auto centre = smear::smear_centre(timing, lamp, {0, shift, 1});
    if (!centre) continue;
    const Rows row = centre->row;
    if (before && abs(row - *before) < Rows(1.5)) {
      spans.back().first = std::min(spans.back().first, row - half);
      spans.back().last = std::max(spans.back().last, row + half);
    } else {
      spans.push_back({row - half, row + half});
    }
    before = row;
  }
  return spans;
}

}  // namespace

CameraSight sight_of(const smear::SmearReading& reading, SensorKind sensor, const smear::CcdTiming& timing,
                     std::optional<Seconds> target, Seconds tolerance) {
  CameraSight sight{reading.lamp, reading.dots, std::nullopt, std::nullopt, {}};
  if (sensor != SensorKind::ccd) return sight;
  sight.tolerance = tolerance / timing.row_time;
  if (reading.lamp && target) {
    sight.target_row = dot_row(timing, reading.lamp->y, *target);
    sight.band = band(timing, reading.lamp->y, *target, tolerance);
  }
  return sight;
}

}  // namespace emberlock::rig
