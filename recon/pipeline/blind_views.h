// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "recon/adjust/prepared_scene.h"
#include "recon/compute/device.h"

namespace emberlock::recon {

/// The scene without its blind views, which get the role `left_out`. A view is blind where
/// - nothing in its picture differs from the rest of it by more than noise: black, white, or one grey
/// - no ray of its pixels meets the scene's box: it looks elsewhere
/// `warnings` name each of them, and why. Error (not_converged): fewer than two of several input views are
/// left, or the only one is blind; it names them too.
Result<PreparedScene> leave_out_blind_views(PreparedScene scene, const ComputeOptions& compute,
                                            std::vector<std::string>& warnings);

}  // namespace emberlock::recon
