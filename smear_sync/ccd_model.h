// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "smear_sync/ccd_timing.h"

namespace emberlock::smear {

// The forward model of smear in an interline CCD: light that leaks into the vertical shift register while the
// register moves.
//
// Conventions. Frame i's read phase starts at t_start + i T and delivers IMAGE i. All times here are relative
// to the start of frame 0's read phase and may be negative. At that instant the picture is transferred to the
// register. During [k t_row, (k + 1) t_row) the register is shifted k rows towards the output; after K shifts
// it rests until the next frame. Charge that leaks in is added to the packet that is then below the light: a
// packet of this image, of the dummy lines behind it, or (wrapped, or at rest) one that will receive the next
// picture.
//
// Source: the paper, "Smear-Based CCD Camera Synchronization", equations (1) to (4), with the K and the
// circular k of a simulated register.

/// Whether the register is emptied just before the next picture is transferred to it. `before_transfer`
/// removes the charge that leaked in behind the image (wrapped dots and those of the rest), so that dots
/// appear only on one side of the lamp.
enum class SweepOut { none, before_transfer };

/// Checks n > 0, K >= n, K t_row <= T, all finite. Error bad_input names the field and its range.
Status check(const CcdTiming& timing);

/// One flash of the lamp: `centre` relative to the start of frame 0's read phase; `width` >= 0.
struct Flash {
  Seconds centre;
  Seconds width;
};

/// The part of a flash that fell into one position of the register.
struct FlashPart {
  int frame = 0;        ///< frame whose read phase, or the rest after it, it fell into
  int shifts = 0;       ///< k in 0..K-1; K stands for the rest
  double fraction = 0;  ///< of the flash's charge
};

/// Splits a flash into the row periods that it overlaps, in order of time. The fractions sum to 1. `timing`
/// must be valid.
std::vector<FlashPart> split(const CcdTiming& timing, Flash flash);

/// The place at which charge is displayed.
struct Landing {
  int image = 0;
  int row = 0;
  friend bool operator==(Landing, Landing) = default;
};

/// The place at which charge is displayed that leaked in at displayed row `row` (0..n-1) during `part`;
/// nullopt if it is in the dummy lines or swept out.
std::optional<Landing> landing(const CcdTiming& timing, int row, const FlashPart& part,
                               SweepOut sweep_out = SweepOut::none);

/// The share of a flash's charge in one row.
struct SmearDeposit {
  int image = 0;
  int row = 0;
  double fraction = 0;
};

/// All visible traces of a flash on displayed row `row`: at most one deposit per image and row, in order of
/// time.
std::vector<SmearDeposit> smear_deposits(const CcdTiming& timing, int row, Flash flash,
                                         SweepOut sweep_out = SweepOut::none);

/// The place of the centre of a lamp at (fractional) row `lamp` after `part`: an image and a fractional row
/// in [-0.5, n - 0.5), or nullopt if the centre isn't displayed.
struct SmearCentre {
  int image = 0;
  Rows row;
};
std::optional<SmearCentre> smear_centre(const CcdTiming& timing, Rows lamp, const FlashPart& part,
                                        SweepOut sweep_out = SweepOut::none);

/// The circular inverse: k = d (dot - lamp) mod K, in [0, K).
Rows shifts_between(const CcdTiming& timing, Rows lamp, Rows dot);

}  // namespace emberlock::smear
