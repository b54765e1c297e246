// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/unique_fd.h"

struct stat;

namespace emberlock {

struct Survey;

/// The list of a result's files, stored in the result's folder: {"format": "emberlock result", "version": 1,
/// "files": [{"path", "verb", "bytes", "modified_ns", "sha256"}]}. Only it makes a folder an earlier result.
/// Files that it doesn't name, or that changed since, belong to somebody else.
inline constexpr const char* kResultList = "emberlock-files.json";

/// The verb that writes an output folder.
struct OutputVerb {
  std::string_view name;  ///< as typed: "calibrate cameras"
  /// Verbs whose results may share the folder. Their files are kept, except those that are written again.
  std::span<const std::string_view> beside = {};
};

/// How a new result replaces an earlier one.
enum class Replace {
  at_once,       ///< the kernel exchanges both folders; two steps where the file system can't exchange
  in_two_steps,  ///< for file systems without exchange: the earlier one is called "TARGET.emberlock-earlier"
                 ///< for a moment
};

struct OutputRequest {
  std::filesystem::path target;
  OutputVerb verb;
  /// Inputs of the verb. The target may not be one of them, contain one, or lie in one.
  std::vector<std::filesystem::path> inputs = {};
  /// Inputs that may lie in the target if they are unchanged files of the earlier result: the verb rewrites
  /// them.
  std::vector<std::filesystem::path> updated = {};
  Replace replace = Replace::at_once;
};

/// Whether a folder at `target` is separate from these inputs. Symlinks, relative paths and bind mounts of
/// the same folders are resolved. Errors: bad_input, naming the input that is in the way.
Status check_apart(const std::filesystem::path& target, const std::vector<std::filesystem::path>& inputs);

/// Succeeds when `folder` is absent or an empty folder. Errors: bad_input.
Status check_new_folder(const std::filesystem::path& folder);

/// Removes the files below `folder` for which `ours` (called with the path within it) returns true, then all
/// empty folders. Symlinks count as files and are never followed. Returns whether everything is gone,
/// `folder` included.
bool remove_ours(const std::filesystem::path& folder,
                 const std::function<bool(const std::string& path, const struct stat& info)>& ours);

/// A folder and its parents, as far as they were missing. When it is destroyed, those that it created and
/// that nothing was put in are removed again.
class MadeFolders {
 public:
  MadeFolders() = default;
  /// Error (io): one of them can't be created.
  static Result<MadeFolders> create(const std::filesystem::path& folder);
  MadeFolders(MadeFolders&&) noexcept = default;
  MadeFolders& operator=(MadeFolders&& o) noexcept;
  ~MadeFolders();
  void keep() { made_.clear(); }

 private:
  std::vector<std::filesystem::path> made_;  // outermost first
};

/// The output folder of a verb. It is filled as a hidden folder beside the target (`path()`) and renamed to
/// the target only when it is complete and on the disk (`commit()`). When it is destroyed without commit(),
/// it removes what was written.
///
/// An existing target is refused unless it is empty or an earlier result of this verb. Of an earlier
/// result, only unchanged files named in its list are replaced. All other files are carried over into the new
/// folder as hard links, without copying. If one of them can't be linked, or has a name that the new result
/// needs, the target stays as it is. If the process is killed at any moment, either the earlier or the new
/// folder is complete, each with everybody else's files.
class OutputFolder {
 public:
  /// Creates the hidden folder, and missing parents of the target. The new folder has the mode of an existing
  /// target, and its owner where that is allowed. Errors: bad_input (what is in the way and what to do about
  /// it; the target is a mount point), io.
  static Result<OutputFolder> create(const OutputRequest& request);
  /// Makes the checks of create() and leaves nothing behind. For verbs that work for long before they write.
  static Status check(const OutputRequest& request);

  OutputFolder(OutputFolder&& o) noexcept;
  OutputFolder& operator=(OutputFolder&&) = delete;
  ~OutputFolder();

  [[nodiscard]] const std::filesystem::path& path() const { return staging_; }
  /// Lists the files in path(), flushes them and renames the folder to the target. If that fails, because
  /// files that can't be carried over have appeared in the target or the system refuses, the target stays as
  /// it is; the complete result is left in "TARGET.new" and the error says so.
  Status commit();

 private:
  explicit OutputFolder(OutputRequest request) : request_(std::move(request)) {}
  /// Surveys the target again and checks that the new result can still replace it.
  Status look_again(Survey& found) const;
  /// Gives the complete result a name of its own. The error adds that name to `why`.
  Error leave_beside(Error why);

  OutputRequest request_;  // its target is resolved
  std::filesystem::path staging_;
  MadeFolders parents_;
  UniqueFd lock_;  // on the list, held while the result isn't finished
};

}  // namespace emberlock
