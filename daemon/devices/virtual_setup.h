#pragma once

#include <vector>

#include "base/result.h"
#include "daemon/config/config.h"
#include "drivers/virtual/options.h"

namespace emberlock {

/// The virtual cameras of a configuration, in its order, and the room that they see (no flame burns). Their
/// row time follows from the picture's height, so that a read phase fills its frame period as the paper's
/// does, unless it is said. Without virtual cameras there are none. Errors: bad_input, as check() has them.
Result<VirtualRigOptions> virtual_setup(const RigConfig& config);

}  // namespace emberlock
