// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>

#include "smear_sync/ccd_timing.h"
#include "smear_sync/reading.h"

namespace emberlock::test {

/// The row at which a flash of no width shows, found by shifting a register packet by packet; none when it
/// rests or the packet becomes a dummy line.
inline std::optional<int> shift_register(const smear::CcdTiming& timing, int lamp_row, Seconds tau) {
  const auto mirrored = [&](int row) {
    return timing.direction == smear::ReadDirection::top_first ? row : timing.rows - 1 - row;
  };
  std::deque<int> packets;  // the image row that each packet will become; front: next to be read out
  for (int row = 0; row < timing.shifts; ++row) packets.push_back(row);
  for (int k = 0; k < timing.shifts; ++k) {
    if (tau < Rows(k + 1) * timing.row_time) {
      const int row = packets[static_cast<std::size_t>(mirrored(lamp_row))];
      return row < timing.rows ? std::optional(mirrored(row)) : std::nullopt;
    }
    packets.pop_front();
    packets.push_back(k);  // an empty packet enters: row k of the next image
  }
  return std::nullopt;
}

inline smear::SmearReading reading_of(double dot_row, double lamp_row) {
  smear::SmearReading reading;
  reading.state = smear::SmearState::dot;
  reading.lamp = smear::LampReading{.x = 100, .y = Rows(lamp_row), .sigma = Rows(0.05), .radius = 4};
  smear::DotReading dot;
  dot.y = Rows(dot_row);
  dot.sigma = Rows(0.05);
  dot.side = dot_row < lamp_row ? smear::Side::above : smear::Side::below;
  reading.dots.push_back(dot);
  return reading;
}

}  // namespace emberlock::test
