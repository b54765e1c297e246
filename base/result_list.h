// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

struct stat;

namespace emberlock {

/// A file as the verb left it.
struct ListedFile {
  std::string path;  ///< within the result
  std::string verb;
  std::uint64_t bytes = 0;
  std::int64_t modified_ns = 0;
};

/// What kResultList says.
struct ResultList {
  std::vector<ListedFile> files;
  bool finished = true;  ///< false while the folder is being filled
};

/// Errors: bad_input where there is none, or it isn't one: another format or version, a path that leads out
/// of the folder, a symlink.
Result<ResultList> read_result_list(const std::filesystem::path& folder);
std::string result_list_text(const ResultList& list);

/// A regular file, as it is now.
ListedFile listed_as(std::string path, std::string verb, const struct stat& info);
/// Whether it is still the file that was listed.
bool is_unchanged(const ListedFile& listed, const struct stat& info);

}  // namespace emberlock
