// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/result.h"
#include "drivers/camera.h"
#include "drivers/strobe.h"
#include "session/reader.h"

// Conversions between devices' data and a session's messages.
namespace emberlock::drivers {

/// The camera's entry in the manifest, for SessionWriter::create.
v1::CameraStream to_proto(const CameraInfo& info);
/// Errors: bad_input where the layout is invalid.
Result<CameraInfo> camera_info(const v1::CameraStream& stream);

/// To be appended after each Strobe::read_back, with its result; read the clock for `now` after that call.
v1::Event strobe_event(TimePoint now, const StrobeSettings& read_back);
/// To be appended after each successful Camera::reset_shutter; read the clock for `now` before that call.
v1::Event reset_event(TimePoint now, const std::string& camera_id, TimePoint at);

/// To be appended after each successful Camera::trim_rate; read the clock for `now` before that call.
v1::Event trim_event(TimePoint now, const std::string& camera_id, PartsPerMillion trim);

/// A frame that didn't arrive within the deadline.
struct LateFrame {
  std::string camera_id;
  std::uint64_t after_frames = 0;  ///< number of frames of the camera that were recorded before it
  Seconds waited;
};
/// To be appended for each, as a note. `at` must be an instant that is already known, without reading the
/// clock.
v1::Event late_event(TimePoint at, const LateFrame& late);
/// nullopt for any other event.
std::optional<LateFrame> late_frame(const v1::Event& event);

/// Errors: bad_input where a number isn't finite or the output is unknown.
Result<StrobeSettings> strobe_settings(const v1::StrobeState& state);

}  // namespace emberlock::drivers
