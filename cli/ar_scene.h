// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apply/flame_player.h"
#include "apply/marker.h"
#include "base/image.h"
#include "base/result.h"
#include "emberlock/v1/session.pb.h"
#include "recon/views/camera_model.h"

namespace emberlock::cli {

/// The lens of a calibration, whose pose doesn't count: the marker tells it. Errors: those of
/// recon::camera_model_of().
Result<recon::Intrinsics> lens_alone(v1::Calibration calibration, ImageSize size,
                                     const std::string& camera_id, const std::string& where);

/// A result that stands upright in the middle of a marker, of its own size, and lights six of the marker
/// around it. `up`: as --up. Errors: those of up_axis().
Result<apply::StandingFlame> upright_on(const apply::Marker& marker, const std::string& result,
                                        const std::string& up);

}  // namespace emberlock::cli
