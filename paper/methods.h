// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "base/result.h"
#include "paper/baselines/method.h"

namespace emberlock::paper {

/// The paper's method (recon/adjust/paper.h) as the paper sets it: flame above 30 grey levels, an opacity of
/// 0.05 a step. Temperatures by its look-up.
Result<MethodResult> the_papers_method(const recon::Scene& scene, const MethodOptions& options);

/// Those of the paper's method: an opacity of 0.05 a step.
recon::Effects papers_effects(const recon::Grid& grid);

/// What `emberlock reconstruct` does where nothing is told: it finds the effects out from the pictures, then
/// solves. Temperatures as of
/// what it is told glows (recon/temperature/temperature.h).
Result<MethodResult> default_method(const recon::Scene& scene, const MethodOptions& options);

inline constexpr std::string_view kPapersMethod = "the paper's", kDefaultMethod = "emberlock";

/// All methods, in the order of the paper's table, then today's, the paper's and ours.
const std::vector<Method>& methods();

/// One of methods(), by MethodFacts::name. Error: none of that name; lists them.
Result<Method> find_method(std::string_view name);

}  // namespace emberlock::paper
