// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace emberlock {

/// "0.2.0" at that release's tag, "0.2.0+12.g1a2b3c4d5e" twelve commits later.
std::string version();

}  // namespace emberlock
