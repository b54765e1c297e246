// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "recon/preprocess/samples.h"

namespace emberlock::recon {

// While a CCD is read, its rows move past the light, and each pixel collects a share of the light of the
// other rows in its column: for constant light, (t_row / exposure) times the leak of the column shutter times
// every other row's light. Rows that are read after the picture is transferred to the register pass the rows
// between them and the output. The rest was passed by their places in the register while the previous picture
// was read, unless a sweep-out emptied it. Changes of a flame between frames are neglected: the previous
// picture is assumed to equal this one.

/// The light of its column that a pixel has collected.
enum class SmearPath {
  whole_column,
  rows_above,  ///< only of the rows above: sweep-out, and the top row is read first
  rows_below,  ///< only of the rows below: sweep-out, and the bottom row is read first
};

struct Smear {
  /// Fraction of a row's light; with three samples per pixel, of the mean of the three channels, since one
  /// charge packet passes below all colours.
  std::array<double, 3> fraction = {};
  double sigma = 0;  ///< standard error of the fractions
  SmearPath path = SmearPath::whole_column;
};

/// Measures the smear in rows without flame: how much brighter they are in columns with light. nullopt if
/// fewer than four rows above and below are free of flame, if no column has light without saturated samples,
/// or if the result is below five sigma. `why`: which of these, or the result.
std::optional<Smear> find_smear(const Samples& samples, std::string* why = nullptr);

/// Removes the smear. A saturated sample is only a lower bound of its column's light; for such columns the
/// smear in their rows without flame is used if it is larger. Returns what was taken from each sample of
/// every row; empty where `path` isn't the whole column.
std::vector<float> remove_smear(Samples& samples, const Smear& smear);
/// That of the other paths as a functor, which doesn't hold the samples.
TakeSmearOfRows taking_smear(const Smear& smear);

}  // namespace emberlock::recon
