// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "recon/preprocess/samples.h"

namespace emberlock::recon {

// A CCD's rows move past the light on their way out, and each pixel picks up a share of what falls on the
// others of its column: in a light that lasts, (t_row / exposure) times the column shutter's leak of every
// other row's light. Rows that are read after the picture enters the register pass what lies between them and
// the output; the rows' own place in the register passed the rest while the picture before was read, unless a
// sweep-out emptied it. What a flame changes from one frame to the next isn't told apart: the picture before
// is taken to be this one.

/// Which light of its column a pixel has picked up.
enum class SmearPath {
  whole_column,
  rows_above,  ///< of its own: sweep-out, and the top row is read first
  rows_below,  ///< sweep-out, and the bottom row is read first
};

struct Smear {
  /// Of a row's light; of the mean of the three channels' light where there are three a pixel: one packet
  /// passes under all colours.
  std::array<double, 3> fraction = {};
  double sigma = 0;  ///< standard error of the fractions
  SmearPath path = SmearPath::whole_column;
};

/// The smear, from rows that show no flame: how much they lighten where their column holds light. Nothing
/// where fewer than four rows above and below are free of flame, where no column has light without saturated
/// samples, or where what is found is below five sigma. `why`: which of these, or what was found.
std::optional<Smear> find_smear(const Samples& samples, std::string* why = nullptr);

/// Takes it out. A saturated sample counts as a lower bound of its column's light: where a column has such,
/// what its rows without flame show stands in if that is more.
void remove_smear(Samples& samples, const Smear& smear);

}  // namespace emberlock::recon
