// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "recon/pipeline/work_precision.h"

namespace emberlock::evaluate {

/// The points that no other one beats in both (Pareto), by rising seconds and strictly falling error. Of
/// equal ones the first stays.
std::vector<recon::WorkPoint> pareto_front(std::vector<recon::WorkPoint> points);

/// One line a point: seconds, heldout_rmse, the settings, and whether it lies on the front.
std::string to_csv(const std::vector<recon::WorkPoint>& points);
/// The inverse, to the last bit. Errors name the line.
Result<std::vector<recon::WorkPoint>> parse_csv(std::string_view text);

/// The options of `emberlock reconstruct` that mean these settings.
std::string command_options(const recon::Settings& settings);

}  // namespace emberlock::evaluate
