// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/result.h"
#include "drivers/virtual/options.h"
#include "rig/config/config.h"

namespace emberlock::rig {

/// The virtual cameras of a configuration, in its order, and the room that they see (no flame burns). Their
/// row time follows from the picture's height, so that a read phase fills its frame period as the paper's
/// does, unless it is said. Without virtual cameras there are none. Errors: bad_input, as check() has them.
Result<drivers::VirtualRigOptions> virtual_setup(const RigConfig& config);

}  // namespace emberlock::rig
