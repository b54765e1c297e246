// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "smear_sync/detect/background.h"
#include "smear_sync/detect/lamp.h"
#include "smear_sync/reading.h"

namespace emberlock::smear::detail {

/// What the lamps that were found and their columns mean: the state and its reason.
SmearReading read_lamps(const Plane& plane, const Background& background, const LampSearch& search,
                        const DetectOptions& options);

/// Why a frame holds nothing that could be read; empty when it does.
std::string unreadable(const ImageView& frame);

SmearReading nothing(std::string reason);

}  // namespace emberlock::smear::detail
