// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/clock.h"
#include "base/progress.h"
#include "base/result.h"
#include "recon/pipeline/reference_front.h"
#include "recon/views/view.h"

namespace emberlock::evaluate {

/// One flame's measurement, in multiples of its reference.
struct MeasuredFront {
  std::vector<recon::WorkPoint> points;  ///< as reference_front()
  std::vector<recon::WorkPoint> ends;    ///< as reference_ends()
  std::vector<recon::WorkPoint> solves;  ///< as reference_solves()
  std::vector<recon::CalibrationRun> calibration;
};
Result<MeasuredFront> measure_front(const recon::Scene& scene, const recon::ComputeOptions& compute,
                                    const Clock& clock, const Progress& progress = {});

/// Both flames' points as reference_front.inc holds them.
Result<std::string> reference_front_source(const recon::ComputeOptions& compute, const Clock& clock,
                                           const Progress& progress = {});

}  // namespace emberlock::evaluate
