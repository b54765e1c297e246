// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "recon/pipeline/reconstruct.h"
#include "recon/views/view.h"

namespace emberlock::report {

/// The page about a reconstruction: its errors and pictures, the volume to turn and in slices, effects, error
/// against time, and where the cameras stand. One file that needs no other and no network. `scene` is what
/// the outcome was made from.
std::string reconstruct_html(const recon::Scene& scene, const recon::Outcome& outcome);

}  // namespace emberlock::report
