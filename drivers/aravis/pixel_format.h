// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "drivers/unpack.h"

namespace emberlock::drivers::aravis {

/// The packing that a name of the Pixel Format Naming Convention means, its size left open; none for what
/// can't be unpacked.
std::optional<PackedPixels> packing_of(std::string_view name);

/// Whether such pixels lie in memory as an Image of theirs does, so that nothing needs to be unpacked.
bool lies_as_image(const PackedPixels& pixels);

}  // namespace emberlock::drivers::aravis
