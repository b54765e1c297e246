// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "emberlock/v1/alignment.pb.h"
#include "rig/align/alignment.h"
#include "rig/align/run.h"

namespace emberlock::rig {

/// What is recorded of a round: what was read and decided, in codes and numbers, all of which a replay must
/// meet bit for bit.
v1::DecisionEvent to_proto(const AlignRoundReport& report);

/// What a recording that begins now is told of the lock that it is made under: each camera's error and its
/// standard error, and the worst pair. Nothing is set of what was read and is ordered.
v1::DecisionEvent lock_evidence(const Alignment& lock, TimePoint now);

}  // namespace emberlock::rig
