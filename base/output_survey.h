// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/output_folder.h"
#include "base/result_list.h"

namespace emberlock {

/// Something in a target that a new result doesn't replace.
struct Kept {
  std::string path;                  ///< within the target
  bool folder = false;               ///< an empty one
  std::optional<ListedFile> listed;  ///< a verb's that may lie beside: gives way to a new file of its name
};

/// What stands at a target before a result takes its place.
struct Survey {
  bool earlier = false;  ///< an earlier result; otherwise absent or empty
  std::vector<Kept> kept;
  std::vector<std::string> replaced;  ///< files of the earlier result, unchanged
};

/// `target` is resolved. Errors: bad_input where `verb` can't replace it, with what is in the way: no folder,
/// no list in it, another verb's result, a file that was changed; io where it can't be read whole.
Result<Survey> survey(const std::filesystem::path& target, const OutputVerb& verb);

/// The target's own name: absolute, symlinks resolved. Errors: bad_input where it can't name a folder.
Result<std::filesystem::path> resolve_target(const std::filesystem::path& target);

/// Why `path`, of the new result, can't take its place beside what is kept; nothing where it can.
std::optional<Error> conflict(const Survey& survey, const std::filesystem::path& staging,
                              const std::filesystem::path& target);

}  // namespace emberlock
