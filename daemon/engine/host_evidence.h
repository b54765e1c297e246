// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "emberlock/v1/alignment.pb.h"

namespace emberlock::daemon {

/// The evidence of a lock for `count` of its cameras, from `first` on; the worst pair stays that of all.
v1::DecisionEvent part_of(const v1::DecisionEvent& lock, std::size_t first, std::size_t count);

}  // namespace emberlock::daemon
