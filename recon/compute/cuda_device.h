// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"

namespace emberlock::recon {

/// Ok where the CUDA backend was built and a GPU answers; otherwise an Error that says which of them is
/// missing.
Status cuda_status();

}  // namespace emberlock::recon
