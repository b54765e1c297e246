// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "base/image.h"
#include "drivers/virtual/light_field.h"
#include "drivers/virtual/scene.h"

namespace emberlock::rig {

/// A flame that doesn't change, for `cameras` cameras with pictures of this size, in the arrangement of
/// stage.h. Rendering it takes a moment.
std::shared_ptr<const drivers::LightField> still_flame(int cameras, ImageSize size);

/// The flame, exposed as it is recorded, in the strobe's room: flashes are seen beside it.
drivers::VirtualScene flame_and_strobe(std::shared_ptr<const drivers::LightField> flame,
                                       const drivers::VirtualScene& room);

}  // namespace emberlock::rig
