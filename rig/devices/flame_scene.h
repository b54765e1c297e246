// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "base/image.h"
#include "drivers/virtual/light_field.h"

namespace emberlock::rig {

/// A flame that stands still amid so many cameras that film pictures of this size, on the stage of stage.h.
/// Drawing it takes a moment.
std::shared_ptr<const drivers::LightField> still_flame(int cameras, ImageSize size);

}  // namespace emberlock::rig
