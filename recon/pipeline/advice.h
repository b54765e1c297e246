// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "recon/export/report.h"

namespace emberlock::recon {

/// What going on would cost and bring, in one sentence, from the trace alone: the held-out error (the input
/// error where nothing is held out) fell by g1 over the run's second quarter and by g2 over its second half;
/// if it goes on so, as many iterations again bring at most g2 * min(1, g2 / g1). From fewer than four
/// points, one more iteration brings at most what the last one brought. Empty with fewer than two.
std::string next_step(const Report& report);

/// Which iteration's volume is the result and why, where it isn't the last one's; otherwise empty.
std::string what_was_kept(const Report& report);

/// Whether the time and the error that were asked for were met: within a twentieth of the budget, as a run
/// ends between iterations. Otherwise what was reached, and what would do.
Status goals_met(const SolveOptions& asked, const Report& report);

/// What half as many voxels again would cost and bring by the reference front, scaled by this run; empty
/// where the front can't tell: nothing held out, or the paper's solver.
std::string more_voxels(const Report& report);

/// Both, as far as there is something to say.
std::vector<std::string> next_steps(const Report& report);

}  // namespace emberlock::recon
