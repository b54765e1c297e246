// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ctime>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "base/unique_fd.h"

// Copies of folders of files that are on the disk and read back.
namespace emberlock::session {

struct FileFacts {
  std::uint64_t bytes = 0;
  timespec modified{};
  std::pair<std::uint64_t, std::uint64_t> device_and_inode{};  ///< equal: the same file
};

/// All files of a folder, such as a session's or its copy's, by their path within it.
struct FolderFiles {
  std::map<std::string, FileFacts> files;
  std::vector<std::filesystem::path> folders;  ///< below the outermost one, parents first
  [[nodiscard]] std::uint64_t bytes() const;
};

/// Errors: bad_input (it holds something other than files and folders), io.
Result<FolderFiles> files_in(const std::filesystem::path& folder);

/// Whether a file and its copy have the same size and time, as far as the copy's file system tells times.
bool times_agree(const FileFacts& file, const FileFacts& copy);

Result<UniqueFd> open_to_read(const std::filesystem::path& path);

/// Bytes that have been handled, of those that have to be. The observer outlives it.
class CopyTally {
 public:
  CopyTally(std::uint64_t all, const Observer& observer);
  /// Error `refused`: cancelled by the observer.
  Status add(std::uint64_t bytes, std::string_view what);

 private:
  std::uint64_t all_;
  std::uint64_t done_ = 0;
  const Observer& observer_;
};

/// Copies and compares files through two buffers of its own.
class FileCopier {
 public:
  /// The copy is on the disk and read back. Counts each byte twice.
  Status copy(const std::filesystem::path& from, const std::filesystem::path& to, const FileFacts& facts,
              CopyTally& tally);
  /// Error (bad_input): the first difference.
  Status compare(const std::filesystem::path& from, const std::filesystem::path& to, CopyTally& tally);

 private:
  static constexpr std::size_t kPart = std::size_t{1} << 20;
  std::string one_ = std::string(kPart, '\0');
  std::string other_ = std::string(kPart, '\0');
};

/// Makes the folder `to` hold the files of `from` that are `wanted`, on the disk, and no others. What is
/// there with the size and time of its original is left as it is. Counts each byte twice.
Status copy_files(const std::filesystem::path& from, const FolderFiles& wanted,
                  const std::filesystem::path& to, CopyTally& tally);

}  // namespace emberlock::session
