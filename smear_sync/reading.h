// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity.h"

namespace emberlock::smear {

/// What one frame of a strobe shows. Rows and columns count from 0 at the centre of the top left pixel.
enum class SmearState {
  dot,        ///< the lamp and exactly one dot
  no_dot,     ///< the lamp, its column clean outside its own bloom: the flash fell into the rest phase or the
              ///< bloom
  comb,       ///< the lamp and two or more dots of one strobe
  steady,     ///< a full-height line: constant light
  saturated,  ///< the lamp's column is saturated so far that a dot can't be told
  blind,  ///< the lamp is lit, but so much of its column is hidden (bloom, image edge) that absence proves
          ///< nothing
  ambiguous,  ///< several explanations fit (two lamps, reflections, hot pixels, compression): see `reason`
  no_lamp,    ///< nothing bright enough to be the lamp
};
std::string_view name(SmearState state);

enum class Side { above, below };  ///< the dot's side of the lamp in the displayed image
std::string_view name(Side side);

struct LampReading {
  double x = 0;       ///< column of the lamp's centre
  Rows y{};           ///< row of the lamp's centre, y_s
  Rows sigma{};       ///< standard error of y
  double radius = 0;  ///< of its saturated or half-height disk, pixels
  bool saturated = false;
};

struct DotReading {
  double x = 0;  ///< column
  Rows y{};      ///< row of its centre, sub-row
  Rows sigma{};  ///< standard error of y
  double snr = 0;
  double amplitude = 0;  ///< peak above the column's baseline, grey levels of the frame's own depth
  Side side = Side::above;
};

/// Everything that the detector read off one frame. `reason` says in one sentence why the state is what it
/// is.
struct SmearReading {
  SmearState state = SmearState::no_lamp;
  std::optional<LampReading> lamp;
  std::vector<DotReading> dots;  ///< top to bottom
  std::string reason;
  /// All lamps of like brightness, the largest first: more than one when a second lamp or a reflection is in
  /// sight.
  std::vector<LampReading> lamps{};
  /// When ambiguous: what stands in the lamp's column and might be a dot, top to bottom. Many frames may tell
  /// (film.h).
  std::vector<DotReading> spots{};
};

}  // namespace emberlock::smear
