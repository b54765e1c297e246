// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "drivers/unpack.h"

namespace emberlock::drivers::aravis {

/// The packing of a name from the Pixel Format Naming Convention, without its size; nullopt if it can't be
/// unpacked.
std::optional<PackedPixels> packing_of(std::string_view name);

/// Whether these pixels have the memory layout of an Image, so that they needn't be unpacked.
bool lies_as_image(const PackedPixels& pixels);

}  // namespace emberlock::drivers::aravis
