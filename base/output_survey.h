// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/output_folder.h"
#include "base/result_list.h"

namespace emberlock {

/// An entry of the target that a new result doesn't replace.
struct Kept {
  std::string path;     ///< within the target
  bool folder = false;  ///< an empty folder
  std::optional<ListedFile>
      listed;  ///< file of a verb whose results may share the folder: a new file of its name replaces it
};

/// The contents of a target before a result replaces it.
struct Survey {
  bool earlier = false;  ///< holds an earlier result; else it is absent or empty
  std::vector<Kept> kept;
  std::vector<std::string> replaced;  ///< unchanged files of the earlier result
};

/// Surveys a resolved target. Errors: bad_input where `verb` can't replace it, saying why (not a folder, no
/// list in it, another verb's result, a file that was changed); io where it can't be read completely.
Result<Survey> survey(const std::filesystem::path& target, const OutputVerb& verb);

/// The target as an absolute path with symlinks resolved. Errors: bad_input where it can't name a folder.
Result<std::filesystem::path> resolve_target(const std::filesystem::path& target);

/// Why `path` of the new result conflicts with what is kept; empty if it doesn't.
std::optional<Error> conflict(const Survey& survey, const std::filesystem::path& staging,
                              const std::filesystem::path& target);

}  // namespace emberlock
