// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/quantity.h"

namespace emberlock::smear {

/// Which displayed row is read first: d of SMEAR's forward model, +1 for the top row, -1 for the bottom row.
enum class ReadDirection : signed char { top_first = +1, bottom_first = -1 };

/// The read-out timing of an interline CCD. Times are modulo the frame period; the read phase starts at
/// t_start.
struct CcdTiming {
  int rows = 720;                                      ///< n, visible rows (> 0)
  int shifts = 720;                                    ///< K, row shifts per read phase, n <= K <= T / t_row
  Seconds frame_period{1 / 23.976};                    ///< T
  SecondsPerRow row_time = microseconds_per_row(54);   ///< t_row
  ReadDirection direction = ReadDirection::top_first;  ///< d
};

}  // namespace emberlock::smear
