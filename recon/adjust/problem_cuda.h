// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "recon/adjust/problem.h"

namespace emberlock::recon {

/// What a problem holds a ray and a key point, of its list whose rays are on the GPU. Throws a DeviceError.
std::shared_ptr<const GpuProblem> read_on_cuda(const Problem& problem);

}  // namespace emberlock::recon
