// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"
#include "base/unique_fd.h"

namespace emberlock::daemon {

/// The folder that holds a session's exported videos. Error: an invalid name.
using ExportFolder = std::function<Result<std::filesystem::path>(std::string_view session)>;

/// A file of an export, open for reading.
struct ExportedFile {
  UniqueFd file;
  std::string name;
  std::string_view type;  ///< for Content-Type
};

/// The file for a URL's path "/exports/SESSION/video/FILE", with escapes. Only a regular file directly in the
/// session's folder of videos is opened, no link; nullopt if there is none.
std::optional<ExportedFile> open_exported(const ExportFolder& folder_of, std::string_view path);

/// The value of Content-Disposition for a file that is saved as `name`, in any script (RFC 6266).
std::string attachment(std::string_view name);

}  // namespace emberlock::daemon
