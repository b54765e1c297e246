#include "daemon/align/sight.h"

#include <cmath>

#include "smear_sync/ccd_model.h"

namespace emberlock {
namespace {

/// Where the dot of a flash that comes at tau stands, if it is displayed.
std::optional<Rows> dot_row(const CcdTiming& timing, Rows lamp, Seconds tau) {
  // A flash in the middle of a row period moves its dot by the rows shifted before.
  const double shifted = (tau / timing.row_time).value() - 0.5;
  const double whole = std::max(0.0, std::floor(shifted));
  if (whole >= timing.shifts) return std::nullopt;  // the register rests
  const auto centre = smear_centre(timing, lamp, {0, static_cast<int>(whole), 1});
  if (!centre) return std::nullopt;
  return centre->row + static_cast<double>(timing.direction) * Rows(shifted - whole);
}

}  // namespace

CameraSight sight_of(const SmearReading& reading, SensorKind sensor, const CcdTiming& timing,
                     std::optional<Seconds> target, Seconds tolerance) {
  CameraSight sight{reading.lamp, reading.dots, std::nullopt, std::nullopt};
  if (sensor != SensorKind::ccd) return sight;
  sight.tolerance = tolerance / timing.row_time;
  if (reading.lamp && target) sight.target_row = dot_row(timing, reading.lamp->y, *target);
  return sight;
}

}  // namespace emberlock
