// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "base/quantity.h"
#include "base/sensor_kind.h"
#include "smear_sync/ccd_timing.h"
#include "smear_sync/reading.h"

namespace emberlock::rig {

/// From `first` to `last`, `first` < `last`.
struct RowSpan {
  Rows first;
  Rows last;
};

/// Where things stand in a camera's picture: columns and rows from 0 at the centre of the top left pixel.
struct CameraSight {
  std::optional<smear::LampReading> lamp;
  std::vector<smear::DotReading> dots;
  std::optional<Rows> target_row;  ///< where a CCD's dot would stand if it were on target; absent where that
                                   ///< is out of sight, or no target is known
  std::optional<Rows> tolerance;   ///< of CCDs: to either side of it
  std::vector<RowSpan> band;       ///< where a CCD's dot in tolerance shows, to half a row: more than one
                                   ///< where rows that aren't displayed, or the register's rest, lie between
};

/// The sight of a frame that reads `reading`. `target`: tau of the target in that round, strobe's delay
/// included.
CameraSight sight_of(const smear::SmearReading& reading, SensorKind sensor, const smear::CcdTiming& timing,
                     std::optional<Seconds> target, Seconds tolerance);

}  // namespace emberlock::rig
