// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "recon/pipeline/work_precision.h"

namespace emberlock::recon {

/// What accuracy costs, measured once for scenes not seen yet: the
/// default solver on the paper's set-up with two simulated flames (geometric means). Seconds are multiples of
/// a reference run's seconds, errors multiples of its error (reference_run.h); voxels are those of a scene
/// whose pictures call for reference_finest(). Remade, when the solver has changed, on a quiet machine by
///   emberlock tradeoff recon --ship recon/pipeline/reference_front.inc
const std::vector<WorkPoint>& reference_front();
int reference_finest();

/// Runs that end by the solver's own rule (iterations 0), which reference_front() has none of: what a
/// reconstruction takes and reaches where nobody limits it. The same units.
const std::vector<WorkPoint>& reference_ends();

/// The same runs without their search for effects: hull, solve and rendering.
const std::vector<WorkPoint>& reference_solves();

/// What a reference run takes on finer grids than the reference's own, in its seconds: the first is 1.
struct CalibrationRun {
  int voxels = 0;
  double seconds = 0;
};
const std::vector<CalibrationRun>& reference_calibration();

/// The front's points in a scene's own units: voxels by what its pictures call for, seconds and grey levels
/// by its reference run.
std::vector<WorkPoint> scaled(std::vector<WorkPoint> front, int finest, double reference_seconds,
                              double reference_error);

/// Of reference_ends() or reference_solves(), those with these effects: the seconds at so many voxels of a
/// scene whose pictures call for `finest`, in their own unit.
double seconds_at(const std::vector<WorkPoint>& runs, std::string_view effects, int finest, int voxels);

}  // namespace emberlock::recon
