// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

struct stat;

namespace emberlock {

/// A file as the verb wrote it.
struct ListedFile {
  std::string path;  ///< relative to the result's folder
  std::string verb;
  std::uint64_t bytes = 0;
  std::int64_t modified_ns = 0;
  std::string sha256 = {};  ///< of its bytes; empty in lists of versions before 0.3
};

/// The content of kResultList.
struct ResultList {
  std::vector<ListedFile> files;
  bool finished = true;  ///< false while the folder is being filled
};

/// Reads the list of a result's folder. Errors: bad_input where there is none or it isn't valid: another
/// format or version, a path that leads out of the folder, a symlink.
Result<ResultList> read_result_list(const std::filesystem::path& folder);
std::string result_list_text(const ResultList& list);

/// Describes a regular file from its stat(), without its hash.
ListedFile listed_as(std::string path, std::string verb, const struct stat& info);
/// Whether the file at `path` is still as listed: by its size and time, or, as a copy has another time, by
/// its bytes.
bool is_unchanged(const ListedFile& listed, const std::filesystem::path& path, const struct stat& info);

}  // namespace emberlock
