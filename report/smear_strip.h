// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/image.h"
#include "smear_sync/ccd_timing.h"
#include "smear_sync/reading.h"

namespace emberlock::report {

/// Rows [from, to] of the displayed image.
struct RowSpan {
  Rows from;
  Rows to;
};

/// The displayed rows in which the dot of a lamp at row `lamp` lies while the phase is within `tolerance` of
/// `tau`. Up to two spans, since rows wrap modulo K; none where the dot wouldn't be visible (rest, dummy
/// lines).
std::vector<RowSpan> tolerance_band(const smear::CcdTiming& timing, Rows lamp, Seconds tau, Rows tolerance);

/// The lamp's column of a frame as inline SVG, full height and `half_width` columns to each side. The
/// contrast is stretched so that a faint dot is visible. It shows a circle around the lamp, ticks at the
/// dots, and the tolerance band: the rows where the dot must lie. Without a lamp the middle column is shown.
std::string smear_strip_svg(const ImageView& frame, const smear::SmearReading& reading,
                            const std::vector<RowSpan>& band, int half_width = 80);

}  // namespace emberlock::report
