// SPDX-License-Identifier: Apache-2.0
// The only source that compiles anew where the version changes.
#include "base/version.h"

namespace emberlock {

std::string version() { return EMBERLOCK_VERSION; }

}  // namespace emberlock
