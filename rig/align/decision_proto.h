// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "emberlock/v1/alignment.pb.h"
#include "rig/align/run.h"

namespace emberlock::rig {

/// What is recorded of a round: what was read and decided, in codes and numbers, all of which a replay must
/// meet bit for bit.
v1::DecisionEvent to_proto(const AlignRoundReport& report);

}  // namespace emberlock::rig
