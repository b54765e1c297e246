// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
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
  std::vector<std::filesystem::path> files{};  ///< in natural order: 9 before 10; GoPro's by its chapters
  std::vector<std::int64_t> numbers{};  ///< of pictures: the last number in each file name; 0 for a stack
};

/// The place of a file among those into which a GoPro camera splits its recordings.
struct GoProChapter {
  std::string recording;  ///< four digits
  std::string chapter;    ///< two digits or letters; empty for the first one of older cameras
};
/// From the file's name: GHccrrrr, GXccrrrr, GPccrrrr or GOPRrrrr; nullopt for other names.
std::optional<GoProChapter> gopro_chapter(const std::filesystem::path& file);

struct FolderScan {
  std::vector<CameraFiles> cameras;      ///< sorted by id in natural order: 9 before 10
  std::vector<std::string> passed_over;  ///< files without a film's extension, relative to the scanned folder
};

struct FolderScanOptions {
  std::map<std::string, std::string> ids{};      ///< the camera's id, by name within the folder
  std::vector<std::filesystem::path> without{};  ///< files to leave out
};

/// Assigns the files of a folder to cameras. Each video file in `folder` is a camera, and each TIFF that
/// holds several pictures. Each subfolder is a camera too: all videos below it, or its pictures where there
/// are no videos. Names that begin with a point
/// are skipped. Errors (bad_input): no films; an id that occurs twice or isn't a valid folder name; names of
/// `ids` that don't exist; pictures without numbers, or two with the same number.
Result<FolderScan> scan_folder(const std::filesystem::path& folder, const FolderScanOptions& options = {});

/// Natural order of names: runs of digits compare by value.
bool natural_less(std::string_view a, std::string_view b);

}  // namespace emberlock::session
