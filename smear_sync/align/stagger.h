// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "smear_sync/align/align.h"

namespace emberlock::smear {

// Staggered cameras film at N instants of a frame period T instead of one. Each camera has a target of its
// own, the common one and an offset; as errors are taken to a camera's own target, the alignment is the same
// in all else.

/// By how much each camera is later than the first of all: the multiples of T / N from 0 to T - T / N, each
/// once. Cameras go by their place around the flame. Neighbours there are far from each other in time: as
/// camera k comes in the order of the fractional parts of k times the golden ratio, those that film near any
/// instant stand all around the flame.
std::vector<Seconds> staggered_offsets(std::size_t cameras, Seconds period);

/// Whether cameras within `tolerance` keep their order in time. Errors (bad_input): fewer than two cameras;
/// a tolerance of half of T / N or more.
Status check_stagger(std::size_t cameras, Seconds period, Seconds tolerance);

/// Whether any camera has a target of its own.
bool staggered(const std::vector<AlignCamera>& cameras);

}  // namespace emberlock::smear
