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

// A rolling shutter as a phase sensor. Row r (in read order) ends its exposure of E seconds at t_start + r
// t_row, so a flash at tau lights the rows from tau / t_row to (tau + E) / t_row: a band. Its first edge
// gives tau, independent of the exposure. If it extends beyond the frame, its last rows are at the top of the
// next frame. A flash in the pause between two frames has no first edge: the camera is blind, like a CCD at
// rest.
//
// The first edge is treated as a dot half a row below where a lamp at row 0 would put it, with the same
// whole-row steps. So phase_of(), sample_of(), fit_row_clock() (bands of a fast strobe are 1 / (f t_row) rows
// apart), find_read_mode() and all that follows work unchanged, with CcdTiming::shifts = rows.

/// The brightness of each row: the mean over its samples, in grey levels of the frame's own depth.
struct RowProfile {
  std::vector<double> level;
  double noise = 0;    ///< standard error of one level
  double clipped = 0;  ///< part of the rows' mean level that is in saturated samples
};
/// Empty for a view that the detector can't read either (empty, malformed, smaller than 8 x 8).
RowProfile row_profile(const ImageView& frame);

/// Each row's brightness without and with the flash: the ambient light, and the scene lit by the flash.
struct BandReference {
  std::vector<double> dark;
  std::vector<double> lit;
};
/// Learns the reference from frames in which each row was once inside and once outside the band: film a
/// detuned or shifted strobe for some frames. Error bad_input if the frames' sizes differ, or a row was never
/// lit or never dark (named).
Result<BandReference> learn_band_reference(std::span<const RowProfile> frames);

struct BandOptions {
  ReadDirection direction = ReadDirection::top_first;
  double min_snr = 6;  ///< of a lit row; below it nothing is read
};

struct BandReading {
  SmearReading reading;       ///< first edges as dots; their sigma from the noise
  std::vector<Rows> lengths;  ///< of bands with both edges in the frame: E / t_row
};

/// Reads the bands of one frame. States: dot (one first edge), comb (several), no_dot (a band without a first
/// edge: the flash fell into the pause), no_lamp (no row is lit), steady (all rows are lit, no edge),
/// ambiguous (sizes differ, or the flash is too faint for min_snr).
BandReading read_bands(const RowProfile& frame, const BandReference& reference,
                       const BandOptions& options = {});

/// A first edge at `row` (in read order), in a frame that arrived at `at` with flashes delayed by `delay`.
struct SweptEdge {
  TimePoint at;
  Seconds delay;
  Rows row;
};

/// Measures t_row from edges that moved with the flash's delay: row t_row = tau + delay + rate at, modulo T,
/// by least squares for t_row, tau and rate. Its accuracy is limited by whole rows: 24 delays over the period
/// give 1 part in 5000. Errors (bad_input): fewer than six edges; edges that move opposite to the delay (the
/// other read direction), or not in proportion to it.
Result<RowClock> fit_swept_row_clock(std::span<const SweptEdge> edges, Seconds period);

}  // namespace emberlock::smear
