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
inline constexpr int kCalibrationSigmas = 15;  ///< numbers of Calibration.sigma, or none, and
inline constexpr int kPoseRootNumbers = 21;    ///< maybe these behind them

std::filesystem::path manifest_path(const std::filesystem::path& folder);
std::filesystem::path events_path(const std::filesystem::path& folder);
std::filesystem::path index_path(const std::filesystem::path& folder, const std::string& camera_id);
/// Relative to the session's folder: "cam0/000003.mkv".
std::string segment_name(const std::string& camera_id, std::uint32_t segment, Encoding encoding);
/// The segment as it lies on disk, the FFV1 one if both are there; an empty path if neither is.
std::filesystem::path find_segment(const std::filesystem::path& folder, const std::string& camera_id,
                                   std::uint32_t segment);

/// Parses and checks; errors name the field. `where` names the file.
Result<v1::Manifest> parse_manifest(std::string_view json, const std::string& where);
Result<v1::Manifest> read_manifest(const std::filesystem::path& folder);
/// What a reader and a writer rely on: version, camera ids fit for folder names and unique, layouts, finite
/// numbers.
Status check_manifest(const v1::Manifest& manifest, const std::string& where);
/// What a writer takes of people: no control characters, not too long. A session that has such is read.
Status check_texts(const v1::Manifest& manifest, const std::string& where);
/// Of a calibration: finite, whole. Of a box: three finite numbers each, sizes above 0. `where` names what
/// holds it.
Status check_calibration(const v1::Calibration& calibration, const std::string& where);
Status check_box(const v1::Box& box, const std::string& where);
Status write_manifest(const std::filesystem::path& folder, const v1::Manifest& manifest);

/// Keeps room on the disk for the finished manifest, so that a session ends well on a full one; and gives it
/// up.
Status keep_reserve(const std::filesystem::path& folder);
void drop_reserve(const std::filesystem::path& folder);

/// Writes all of `bytes`, whatever signals come.
Status write_fully(int fd, std::string_view bytes, const std::filesystem::path& path);
/// "PATH: ACTION: <errno's words>" as an io error.
Error errno_error(const std::filesystem::path& path, const std::string& action);

}  // namespace emberlock::session
