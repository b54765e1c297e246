// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "smear_sync/detect/background.h"
#include "smear_sync/detect/lamp.h"
#include "smear_sync/reading.h"

namespace emberlock::smear::detail {

/// Classifies the found lamps and their columns: the state and its reason.
SmearReading read_lamps(const Plane& plane, const Background& background, const LampSearch& search,
                        const DetectOptions& options);

/// Why a frame can't be read; empty if it can.
std::string unreadable(const ImageView& frame);

SmearReading nothing(std::string reason);

}  // namespace emberlock::smear::detail
