// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity.h"

namespace emberlock::smear {

/// The content of one frame of a strobe. Rows and columns count from 0 at the centre of the top left pixel.
enum class SmearState {
  dot,     ///< the lamp and exactly one dot
  no_dot,  ///< the lamp and a clean column outside its bloom: the flash fell into the rest phase or the bloom
  comb,    ///< the lamp and two or more dots of one strobe
  steady,  ///< a line over the full height: constant light
  saturated,  ///< the lamp's column is so saturated that no dot could be seen
  blind,  ///< the lamp is lit, but so much of its column is hidden (bloom, image edge) that the absence of a
          ///< dot proves nothing
  ambiguous,  ///< several explanations fit (two lamps, reflections, hot pixels, compression): see `reason`
  no_lamp,    ///< nothing is bright enough to be the lamp
};
std::string_view name(SmearState state);

enum class Side { above, below };  ///< on which side of the lamp the dot is displayed
std::string_view name(Side side);

struct LampReading {
  double x = 0;       ///< column of the lamp's centre
  Rows y{};           ///< row of the lamp's centre, y_s
  Rows sigma{};       ///< standard error of y
  double radius = 0;  ///< of its saturated disk, or of its disk at half height, pixels
  bool saturated = false;
};

struct DotReading {
  double x = 0;  ///< column
  Rows y{};      ///< row of its centre, with sub-row resolution
  Rows sigma{};  ///< standard error of y
  double snr = 0;
  double amplitude = 0;  ///< peak above the column's baseline, grey levels of the frame's own depth
  Side side = Side::above;
};

/// The result of the detector for one frame. `reason` explains the state in one sentence.
struct SmearReading {
  SmearState state = SmearState::no_lamp;
  std::optional<LampReading> lamp;
  std::vector<DotReading> dots;  ///< top to bottom
  std::string reason;
  /// All lamps of similar brightness, the largest first. More than one if a second lamp or a reflection is
  /// visible.
  std::vector<LampReading> lamps{};
  /// In state `ambiguous`: the spots in the lamp's column that might be dots, top to bottom. Many frames
  /// together may resolve them (film.h).
  std::vector<DotReading> spots{};
};

}  // namespace emberlock::smear
