// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "recon/views/flame_mask.h"

namespace emberlock::recon {

/// flame_masks() of these pictures on the calling thread's GPU, which keeps them too. Throws a DeviceError.
std::vector<FlameMask> masks_on_cuda(const std::vector<SharedImage>& images, std::optional<double> threshold);

}  // namespace emberlock::recon
