// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "drivers/camera.h"
#include "session/writer.h"

namespace emberlock::rig {

/// Upper limit of a recording's data rate, with each camera at its nominal rate. For FFV1 it assumes noise,
/// which can't be compressed; how well a flame compresses isn't known beforehand.
double bytes_per_second(std::span<const drivers::CameraInfo> cameras, session::Encoding encoding);

}  // namespace emberlock::rig
