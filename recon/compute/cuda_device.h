// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

namespace emberlock::recon {

/// Ok if the CUDA backend was built and this GPU answers; otherwise the Error says which is missing.
Status cuda_status(int gpu = 0);

/// The GPU of all that the calling thread does from here on. Throws a DeviceError.
void use_gpu(int gpu);

}  // namespace emberlock::recon
