// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "paper/run.h"

namespace emberlock::paper {

/// Runs the paper's or the default solver once more and looks at it after each of the protocol's iterations:
/// errors, and after 10, 30, 50 and 70 a picture of the first test view ("after-10"). Nothing of other
/// methods, which don't iterate by passes of all pictures. The clock stands still while it is looked at.
/// Where that fails the run has the points up to there, and why (MethodRun::passes_failed).
void add_passes(const Protocol& protocol, const Method& method, const KnownGas& gas,
                const recon::Scene& scene, const RunSettings& settings, const Clock& clock, MethodRun& run);

}  // namespace emberlock::paper
