// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "base/time_point.h"
#include "smear_sync/ccd_timing.h"
#include "smear_sync/clocks/row_clock.h"
#include "smear_sync/reading.h"

namespace emberlock::smear {

// A rolling shutter as a phase sensor. Row r (in the order of reading) ends its exposure of E seconds at
// t_start + r t_row, so a flash at tau lights the rows from tau / t_row to (tau + E) / t_row: a band, whose
// first edge tells tau whatever the exposure, and whose last rows, where it reaches beyond the frame, stand
// at the top of the next one. A flash within the pause between two frames shows no first edge: blind, as with
// a CCD at rest.
//
// The first edge is read as a dot half a row below a lamp at row 0 would be, whole rows and all: so
// phase_of(), sample_of(), fit_row_clock() (bands of a fast strobe stand 1 / (f t_row) rows apart),
// find_read_mode() and what follows take it unchanged, with CcdTiming::shifts = rows.

/// What a row gathers: mean over its samples, grey levels of the frame's own depth.
struct RowProfile {
  std::vector<double> level;
  double noise = 0;    ///< standard error of one level
  double clipped = 0;  ///< what saturated samples hold of the rows' mean level
};
/// A view that the detector can't read either (empty, malformed, smaller than 8 x 8) has no rows.
RowProfile row_profile(const ImageView& frame);

/// The picture without and with the flash, row by row: ambient light, and the scene's own brightness under
/// the flash.
struct BandReference {
  std::vector<double> dark;
  std::vector<double> lit;
};
/// From frames in which each row was in the band now and out of it then: film a strobe that is detuned, or
/// moved, for some frames. Error bad_input when frames differ in size or some row was never lit or never
/// dark: names the row.
Result<BandReference> learn_band_reference(std::span<const RowProfile> frames);

struct BandOptions {
  ReadDirection direction = ReadDirection::top_first;
  double min_snr = 6;  ///< of a lit row against the noise, below which nothing is read
};

struct BandReading {
  SmearReading reading;       ///< first edges as dots; their sigma from the noise
  std::vector<Rows> lengths;  ///< of bands with both edges in the frame: E / t_row
};

/// The bands of one frame. States: dot (one first edge), comb (several), no_dot (a band without a first edge:
/// the flash fell into the pause), no_lamp (no row is lit), steady (all rows are: no edge), ambiguous (sizes
/// differ, or the flash is too faint for min_snr).
BandReading read_bands(const RowProfile& frame, const BandReference& reference,
                       const BandOptions& options = {});

/// A first edge that stood at `row`, counted in the order of reading, in a frame that came at `at` while the
/// flashes came `delay` late.
struct SweptEdge {
  TimePoint at;
  Seconds delay;
  Rows row;
};

/// t_row from edges that moved with the flash's delay: row t_row = tau + delay + rate at, modulo T, by least
/// squares for t_row, tau and rate. Whole rows limit it: 24 delays over the period give 1 part in 5000.
/// Errors (bad_input): fewer than six edges; edges that move against the delay (the other read direction),
/// or not in step with it.
Result<RowClock> fit_swept_row_clock(std::span<const SweptEdge> edges, Seconds period);

}  // namespace emberlock::smear
