// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace emberlock::session {

/// The files of one camera in a folder of foreign recordings.
struct CameraFiles {
  enum class Kind { video, pictures };
  std::string id;    ///< name of the subfolder, or of the file without its extension
  std::string name;  ///< the subfolder or file, relative to the scanned folder
  Kind kind = Kind::video;
  std::vector<std::filesystem::path> files{};  ///< in natural order: 9 before 10
  std::vector<std::int64_t> numbers{};         ///< of pictures: the last number in each file name
};

struct FolderScan {
  std::vector<CameraFiles> cameras;      ///< sorted by id in natural order: 9 before 10
  std::vector<std::string> passed_over;  ///< files without a film's extension, relative to the scanned folder
};

struct FolderScanOptions {
  std::map<std::string, std::string> ids{};      ///< the camera's id, by name within the folder
  std::vector<std::filesystem::path> without{};  ///< files to leave out
};

/// Assigns the files of a folder to cameras. Each video file in `folder` is a camera. Each subfolder is a
/// camera too: all videos below it, or its pictures where there are no videos. Names that begin with a point
/// are skipped. Errors (bad_input): no films; an id that occurs twice or isn't a valid folder name; names of
/// `ids` that don't exist; pictures without numbers, or two with the same number.
Result<FolderScan> scan_folder(const std::filesystem::path& folder, const FolderScanOptions& options = {});

/// Natural order of names: runs of digits compare by value.
bool natural_less(std::string_view a, std::string_view b);

}  // namespace emberlock::session
