// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

namespace emberlock::recon {

/// Ok if the CUDA backend was built and a GPU answers; otherwise the Error says which is missing.
Status cuda_status();

}  // namespace emberlock::recon
