// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "emberlock/v1/services.pb.h"
#include "emberlock/v1/status.pb.h"

// The daemon's data as text for a terminal.
namespace emberlock::cli {

/// A message on one line of JSON with the field names of the .proto, for --json.
std::string json_line(const google::protobuf::Message& message);
/// "LOCKED" as "locked", "BY_HAND" as "by hand".
std::string in_words(std::string enum_name);
std::string in_words(v1::Light light);
/// "1.5 GB", "980 kB": powers of ten.
std::string bytes_in_words(double bytes);
/// "0.4 s", "12 s", "5 min 20 s", "3 h 10 min".
std::string seconds_in_words(double seconds);

/// "0.54 ms (10.0 rows)".
std::string tolerance_in_words(double seconds, double rows);
/// "a take may be 42 s long, most likely 3 min 0 s, then left leaves tolerance"; empty where nothing is
/// locked.
std::string lock_in_words(const v1::AlignmentStatus& alignment);

/// One screen of `emberlock status`.
std::string status_screen(const v1::DaemonStatus& status);
/// "candle: 12 s, 3168 frames, none lost, 1.2 GB, 86.1 MB/s, queue 3 %".
std::string recording_line(const v1::RecordingStatus& recording);
/// Live volumes: "frame 120, 0.9 s ago: 64 voxels, 0.41 s a volume, 23 frames skipped, on cuda"; `now_ns` as
/// in the status that they are of.
std::string live_line(const v1::LiveStatus& live, std::int64_t now_ns);
/// "salvage of take 1: 34 % done"; "compression of take 2: waits".
std::string job_line(const v1::Job& job);
/// Frames that a recording lost, by cause: "12 queue, 3 transport"; "none".
std::string losses(const v1::Counts& counts);
/// "iteration 3: 2.1 s, input error 5.31, held-out error 6.20 grey levels".
std::string iteration_line(const v1::Iteration& iteration);
/// "take 1 live: frame 120, 0.9 s after it was filmed, 0.41 s a volume".
std::string live_preview_line(const v1::IterationPreview& preview);
/// A frame of a sequence: "frame 12: done, input error 5.31, held-out error about 6.20 grey levels".
std::string frame_line(const v1::SequenceFrame& frame);
/// A round of alignment: one line, and one for each camera that is to be reset or isn't well.
std::string round_line(const v1::DaemonStatus& status);
/// The same with a line for every camera.
std::string round_table(const v1::DaemonStatus& status);

}  // namespace emberlock::cli
