// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "emberlock/v1/rig.pb.h"

// rig.json: the calibration of a rig's cameras, independent of any recording.
namespace emberlock::session {

inline constexpr std::uint32_t kRigFormatVersion = 1;

/// Checks version, camera ids (unique, valid folder names), sizes and finite numbers. `where` names the file.
/// A camera may have no calibration (when only its colour is calibrated), and a calibration no pose.
Status check_rig(const v1::Rig& rig, const std::string& where);
/// Parses and checks. Errors name the field.
Result<v1::Rig> parse_rig(std::string_view json, const std::string& where);
Result<v1::Rig> read_rig(const std::filesystem::path& path);
/// The JSON that parse_rig() reads, indented.
Result<std::string> rig_json(const v1::Rig& rig);
/// Checks, then writes atomically.
Status write_rig(const std::filesystem::path& path, const v1::Rig& rig);

}  // namespace emberlock::session
