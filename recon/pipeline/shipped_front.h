#pragma once

#include <string>
#include <vector>

#include "base/clock.h"
#include "base/progress.h"
#include "recon/pipeline/work_precision.h"
#include "recon/preprocess/view.h"

namespace emberlock {

/// What accuracy costs, measured once for scenes not seen yet: the default solver on the paper's set-up with
/// two simulated flames (geometric means). Seconds are multiples of a reference run's seconds, errors
/// multiples of its error (reference_run.h); voxels are those of a scene whose pictures call for
/// shipped_finest(). Remade, when the solver has changed, on a quiet machine by
///   emberlock tradeoff recon --ship recon/pipeline/shipped_front.inc
const std::vector<WorkPoint>& shipped_front();
int shipped_finest();

/// The front's points in a scene's own units: voxels by what its pictures call for, seconds and grey levels
/// by its reference run.
std::vector<WorkPoint> scaled(std::vector<WorkPoint> front, int finest, double reference_seconds,
                              double reference_error);

/// The sweep that is shipped, one flame's measurement: its points in multiples of the reference.
Result<std::vector<WorkPoint>> measure_front(const Scene& scene, const ComputeOptions& compute,
                                             const Clock& clock, const Progress& progress = {});

/// Both flames' points as shipped_front.inc holds them.
Result<std::string> measure_shipped_source(const ComputeOptions& compute, const Clock& clock,
                                           const Progress& progress = {});

}  // namespace emberlock
