// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "recon/preprocess/flame_mask.h"

namespace emberlock::recon {

/// flame_masks() on the calling thread's GPU, which keeps them too. Throws a DeviceError.
std::vector<FlameMask> masks_on_cuda(const Scene& scene, std::optional<double> threshold);

}  // namespace emberlock::recon
