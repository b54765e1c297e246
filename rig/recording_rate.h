// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "drivers/camera.h"
#include "session/writer.h"

namespace emberlock::rig {

/// What a recording of these cameras takes of the disk at most, each at its nominal rate. FFV1 is counted
/// with what noise makes of it, which it can't compress: how well a flame does nobody knows before.
double bytes_per_second(std::span<const drivers::CameraInfo> cameras, session::Encoding encoding);

}  // namespace emberlock::rig
