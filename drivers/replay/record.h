// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/result.h"
#include "drivers/camera.h"
#include "drivers/strobe.h"
#include "session/reader.h"

// How devices are written into a session, and read back from it.
namespace emberlock::drivers {

/// The manifest's entry of a camera, ready for SessionWriter::create.
v1::CameraStream to_proto(const CameraInfo& info);
/// Errors: bad_input where the layout is unusable.
Result<CameraInfo> camera_info(const v1::CameraStream& stream);

/// To be appended after each Strobe::read_back, with what it said and `now` asked after it.
v1::Event strobe_event(TimePoint now, const StrobeSettings& read_back);
/// To be appended after each Camera::reset_shutter that succeeded, with `now` asked before it.
v1::Event reset_event(TimePoint now, const std::string& camera_id, TimePoint at);

/// To be appended after each Camera::trim_rate that succeeded, with `now` asked before it.
v1::Event trim_event(TimePoint now, const std::string& camera_id, PartsPerMillion trim);

/// A frame that was waited for in vain.
struct LateFrame {
  std::string camera_id;
  std::uint64_t after_frames = 0;  ///< so many of the camera's frames are recorded before
  Seconds waited;
};
/// To be appended for each, as a note; `at` is an instant that is known already.
v1::Event late_event(TimePoint at, const LateFrame& late);
/// Of any other event none.
std::optional<LateFrame> late_frame(const v1::Event& event);

/// Errors: bad_input where a number isn't finite or the output unknown.
Result<StrobeSettings> strobe_settings(const v1::StrobeState& state);

}  // namespace emberlock::drivers
