// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "drivers/camera.h"

namespace emberlock::rig {

/// The frame period of cameras that can be held in step by resets. Errors (bad_input): no camera; rates that
/// differ by more than 500 ppm.
Result<Seconds> common_period(const std::vector<drivers::Camera*>& cameras);

/// AlignRunOptions::offsets of these cameras where they film at instants spread evenly over the frame period
/// (smear_sync/align/stagger.h), given in the order in which they stand around the flame. Errors: those of
/// common_period(); fewer than two cameras.
Result<std::vector<Seconds>> stagger(const std::vector<drivers::Camera*>& cameras);

}  // namespace emberlock::rig
