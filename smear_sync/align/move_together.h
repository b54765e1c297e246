// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/quantity.h"

namespace emberlock::smear {

/// How a camera's tau moved from where it was seen last to where it is seen now, in which time the strobe was
/// moved.
struct DotMove {
  Seconds strobe;    ///< by how much the strobe was moved
  Seconds expected;  ///< what tau moves by: as the strobe, and as the camera drifts
  Seconds seen;      ///< what it did move by
  Seconds sigma;     ///< standard error of `seen - expected`
};

/// What stands in a camera's picture for its dot, told by moving the strobe.
enum class DotMotion {
  untold,     ///< not seen at two places of the strobe, or too roughly
  with_all,   ///< as the other cameras' dots, and as the strobe
  none,       ///< it stands still: a reflection of the lamp, or hot pixels
  against,    ///< as far as the others' the other way round: its read direction is set wrong
  otherwise,  ///< by neither: a wrong row time, a reset that nobody ordered, a reflection of another flash
};

/// Two phases, each known to this part of the strobe's step, tell a dot that followed it from one that stood.
constexpr double kToldPartOfStep = 1.0 / 20;

/// The motions of all the cameras that filmed the same flashes, by camera; nothing of one that wasn't seen
/// twice. What most of them differ by from what is expected, counting the strobe's word for one camera more,
/// is their common motion: a period offset that is known too roughly, a strobe that isn't where it says.
/// Differences of up to five standard errors are none; a move is told from standing still from twice as much
/// on, and one way from the other where twice the way isn't whole periods to that.
std::vector<DotMotion> move_together(std::span<const std::optional<DotMove>> cameras, Seconds period);

}  // namespace emberlock::smear
