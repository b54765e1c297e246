// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace emberlock::evaluate {

/// "Intel Xeon ..., 2 threads, device auto": on what a time was measured. `threads`: 0 is one per core.
std::string machine(int threads, const std::string& device);

}  // namespace emberlock::evaluate
