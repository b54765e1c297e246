// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/frame.h"
#include "base/result.h"
#include "drivers/camera.h"
#include "emberlock/v1/hosts.pb.h"

// Frames on their way from host to host.
namespace emberlock::daemon {

/// `counts` are the camera's, this frame included.
v1::LentFrame to_proto(const Frame& frame, const drivers::FrameCounts& counts);
/// Its stamp stays on the lending host's clock. Errors: bad_input (an unusable layout; pixels more or fewer
/// than that has; `where` names the camera).
Result<Frame> frame_of(const v1::LentFrame& lent, const std::string& where);

drivers::FrameCounts counts_of(const v1::CameraCounts& counts);
v1::CameraCounts to_proto(const drivers::FrameCounts& counts);

}  // namespace emberlock::daemon
