// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "smear_sync/ccd_timing.h"

namespace emberlock::smear {

// The forward model of smear in an interline CCD: light that leaks into the vertical shift register while it
// moves.
//
// Conventions. Frame i's read phase starts at t_start + i T and delivers IMAGE i; all times here are relative
// to the start of frame 0's read phase and may be negative. At that instant the picture enters the register.
// During [k t_row, (k + 1) t_row) the register stands k rows further towards the output; after K shifts it
// rests until the next frame. Charge that leaks in then is delivered with whatever packet stands under the
// light: a packet of this image, of the dummy lines behind it, or (wrapped, or at rest) one that the next
// picture will enter.
//
// Source: the paper, "Smear-Based CCD Camera Synchronization", equations (1) to (4), with K and the circular
// k of a simulated register.

/// Whether the register is emptied just before the next picture enters it. `before_transfer` removes what
/// leaked in behind the image (the wrapped dots and those of the rest), so that dots are seen on one side of
/// the lamp only.
enum class SweepOut { none, before_transfer };

/// n > 0, K >= n, K t_row <= T, all finite; otherwise bad_input that names the field and its range.
Status check(const CcdTiming& timing);

/// One flash of the lamp: `centre` after the start of frame 0's read phase; `width` >= 0.
struct Flash {
  Seconds centre;
  Seconds width;
};

/// The part of a flash that fell while the register stood still.
struct FlashPart {
  int frame = 0;        ///< whose read phase, or the rest after it
  int shifts = 0;       ///< k in 0..K-1; K stands for the rest
  double fraction = 0;  ///< of the flash's charge
};

/// Splits a flash over the row periods that it overlaps, in order of time; the fractions sum to 1. `timing`
/// is valid.
std::vector<FlashPart> split(const CcdTiming& timing, Flash flash);

/// Where charge is displayed.
struct Landing {
  int image = 0;
  int row = 0;
  friend bool operator==(Landing, Landing) = default;
};

/// Where the charge that leaks in at displayed row `row` (0..n-1) during `part` is displayed; nothing when it
/// goes with the dummy lines or is swept out.
std::optional<Landing> landing(const CcdTiming& timing, int row, const FlashPart& part,
                               SweepOut sweep_out = SweepOut::none);

/// One row's share of a flash's charge.
struct SmearDeposit {
  int image = 0;
  int row = 0;
  double fraction = 0;
};

/// All that is seen of a flash on displayed row `row`: at most one deposit an image and row, in order of
/// time.
std::vector<SmearDeposit> smear_deposits(const CcdTiming& timing, int row, Flash flash,
                                         SweepOut sweep_out = SweepOut::none);

/// Where the centre of a lamp imaged at (fractional) row `lamp` lands after `part`: an image and a fractional
/// row in
/// [-0.5, n - 0.5), or nothing when that centre is not displayed.
struct SmearCentre {
  int image = 0;
  Rows row;
};
std::optional<SmearCentre> smear_centre(const CcdTiming& timing, Rows lamp, const FlashPart& part,
                                        SweepOut sweep_out = SweepOut::none);

/// The circular inverse: k = d (dot - lamp) mod K, in [0, K).
Rows shifts_between(const CcdTiming& timing, Rows lamp, Rows dot);

}  // namespace emberlock::smear
