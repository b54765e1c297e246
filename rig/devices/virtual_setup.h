// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/result.h"
#include "drivers/virtual/options.h"
#include "rig/config/config.h"

namespace emberlock::rig {

/// The virtual cameras of a configuration, in its order, and the room that they see (without a flame). Unless
/// configured, the row time follows from the picture's height, so that a read phase takes the same part of
/// the frame period as the paper's. Empty without virtual cameras. Errors: bad_input, as from check().
Result<drivers::VirtualRigOptions> virtual_setup(const RigConfig& config);

}  // namespace emberlock::rig
