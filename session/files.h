// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "emberlock/v1/session.pb.h"
#include "session/writer.h"

// Names and small files of a session's folder.
namespace emberlock::session {

inline constexpr std::uint32_t kSessionFormatVersion = 1;
inline constexpr int kCalibrationSigmas = 15;  ///< length of Calibration.sigma, or 0
inline constexpr int kPoseRootNumbers = 21;    ///< length of the optional pose root behind it

std::filesystem::path manifest_path(const std::filesystem::path& folder);
std::filesystem::path events_path(const std::filesystem::path& folder);
std::filesystem::path index_path(const std::filesystem::path& folder, const std::string& camera_id);
/// Path relative to the session's folder: "cam0/000003.mkv".
std::string segment_name(const std::string& camera_id, std::uint32_t segment, Encoding encoding);
/// The segment's file on disk; the FFV1 one if both encodings exist, an empty path if none does.
std::filesystem::path find_segment(const std::filesystem::path& folder, const std::string& camera_id,
                                   std::uint32_t segment);

/// Parses and checks a manifest. Errors name the field. `where` names the file.
Result<v1::Manifest> parse_manifest(std::string_view json, const std::string& where);
Result<v1::Manifest> read_manifest(const std::filesystem::path& folder);
/// Checks what readers and writers rely on: version, camera ids that are unique and valid folder names,
/// layouts, finite numbers, clocks.
Status check_manifest(const v1::Manifest& manifest, const std::string& where);
/// Checks texts before they are written: length, no control characters. Reading accepts any text.
Status check_texts(const v1::Manifest& manifest, const std::string& where);
/// Calibration: complete and finite. Box: three finite numbers each, sizes above 0. `where` names the object
/// that holds it.
Status check_calibration(const v1::Calibration& calibration, const std::string& where);
Status check_box(const v1::Box& box, const std::string& where);
Status write_manifest(const std::filesystem::path& folder, const v1::Manifest& manifest);

/// keep_reserve() reserves disk space for the finished manifest, so that a session can be finished on a full
/// disk; drop_reserve() frees it.
Status keep_reserve(const std::filesystem::path& folder);
void drop_reserve(const std::filesystem::path& folder);

/// Writes all of `bytes`; continues after interrupting signals.
Status write_fully(int fd, std::string_view bytes, const std::filesystem::path& path);
/// "PATH: ACTION: <errno's words>" as an io error.
Error errno_error(const std::filesystem::path& path, const std::string& action);

}  // namespace emberlock::session
