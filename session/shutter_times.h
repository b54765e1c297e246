// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "base/result.h"
#include "emberlock/v1/session.pb.h"
#include "session/reader.h"

// times.json, an optional file of a session: the frames' exposure times, known more precisely than their
// stamps.
namespace emberlock::session {

std::filesystem::path shutter_times_path(const std::filesystem::path& folder);

/// Parses protobuf's JSON mapping. All numbers must be finite, standard errors not negative. `where` names
/// the file.
Result<v1::ShutterTimes> parse_shutter_times(std::string_view json, const std::string& where);

/// Replaces the folder's times.json atomically. Errors: bad_input (a number that isn't finite), io.
Status write_shutter_times(const std::filesystem::path& folder, const v1::ShutterTimes& times);

/// The session's times: one entry per camera in the manifest's order, each with one number per frame of that
/// camera's index. nullopt where the session has no times.json. Errors (bad_input) name file and camera: an
/// entry that is missing, unknown or duplicate, or a list whose length differs from the index.
Result<std::optional<v1::ShutterTimes>> read_shutter_times(const SessionReader& session);

}  // namespace emberlock::session
