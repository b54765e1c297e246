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
  std::string id;    ///< of the subfolder, or of the file less its ending
  std::string name;  ///< the subfolder or file, within the scanned folder
  Kind kind = Kind::video;
  std::vector<std::filesystem::path> files{};  ///< in order: 9 before 10
  std::vector<std::int64_t> numbers{};         ///< of pictures: the last number in each one's name
};

struct FolderScan {
  std::vector<CameraFiles> cameras;      ///< by id, 9 before 10
  std::vector<std::string> passed_over;  ///< what is no film by its ending, within the scanned folder
};

struct FolderScanOptions {
  std::map<std::string, std::string> ids{};      ///< by name within the folder: the id that it is to have
  std::vector<std::filesystem::path> without{};  ///< files that are no camera's film
};

/// Which file is which camera's: each video file of `folder` is a camera's, and so are all videos below each
/// of its subfolders, or its pictures where there are no videos. Names that begin with a point are passed
/// over. Errors (bad_input): no films; an id there twice, or that can't name a folder; names of `ids` that
/// aren't there; pictures without numbers, or with one number twice.
Result<FolderScan> scan_folder(const std::filesystem::path& folder, const FolderScanOptions& options = {});

/// As people order names: runs of digits by their value.
bool natural_less(std::string_view a, std::string_view b);

}  // namespace emberlock::session
