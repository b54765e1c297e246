// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "base/result.h"
#include "emberlock/v1/session.pb.h"
#include "session/reader.h"

// times.json, the sidecar of a session whose frames' true instants are known finer than their stamps tell.
namespace emberlock::session {

std::filesystem::path shutter_times_path(const std::filesystem::path& folder);

/// Parses protobuf's JSON mapping; all numbers are finite and no standard error is negative. `where` names
/// the file.
Result<v1::ShutterTimes> parse_shutter_times(std::string_view json, const std::string& where);

/// Replaces the folder's times.json, in one step. Errors: bad_input (a number that isn't finite), io.
Status write_shutter_times(const std::filesystem::path& folder, const v1::ShutterTimes& times);

/// The session's times, one entry for each of its cameras in the manifest's order, each with one number a
/// frame of that camera's index; nullopt where the session has no times.json. Errors (bad_input) name the
/// file and the camera: an entry that is absent, unknown or there twice, a list that isn't as long as the
/// index.
Result<std::optional<v1::ShutterTimes>> read_shutter_times(const SessionReader& session);

}  // namespace emberlock::session
