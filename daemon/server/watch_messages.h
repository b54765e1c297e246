// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "emberlock/v1/services.pb.h"
#include "emberlock/v1/status.pb.h"

// Messages of the console's WebSocket. From the daemon, as text: {"rounds": AlignmentStatus with only its
// history} at the beginning and when that changed, {"status": DaemonStatus without it}, {"notice": Notice},
// {"iteration": IterationPreview without bytes}. Binary messages carry bytes: the length of a header (u32,
// little-endian), the header (JSON with a "kind"), then the bytes. From the console, as text: {"watch":
// WatchPicturesRequest}, or {"watch": null} for no pictures.
namespace emberlock::daemon {

struct WatchMessage {
  enum class Kind { text, binary };
  Kind kind = Kind::text;
  std::string bytes;
};

WatchMessage watch_message(const v1::DaemonStatus& status);
WatchMessage history_message(const v1::DaemonStatus& status);
WatchMessage watch_message(const v1::Notice& notice);
/// {"kind": "picture", "camera_id", "frame_id", "monotonic_ns", "width", "height"} and the JPEG.
WatchMessage watch_message(const v1::Picture& picture);
/// The numbers; then those that exist of {"kind": "captured"
/// "rendered", "reconstruction", "iteration", "camera_id"} with a JPEG, and {"kind": "volume",
/// "reconstruction", "iteration", "nx", "ny", "nz", "box", "brightest", "layers"} with the voxels and behind
/// them those of each layer, {"kind", "low", "high", "quick"} (VolumeLayer).
std::vector<WatchMessage> watch_messages(const v1::IterationPreview& preview);

/// The pictures that a console's message asks for, or none. Error bad_input: not such a message.
Result<std::optional<v1::WatchPicturesRequest>> parse_wish(std::string_view text);

}  // namespace emberlock::daemon
