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

/// The list of a result's files, which lies in it: {"format": "emberlock result", "version": 1, "files":
/// [{"path", "verb", "bytes", "modified_ns"}]}. A folder is an earlier result if it holds such a list, never
/// by any other file's name; what the list doesn't name, or what was changed since, is somebody else's.
inline constexpr const char* kResultList = "emberlock-files.json";

/// Who makes an output folder.
struct OutputVerb {
  std::string_view name;  ///< as typed: "calibrate cameras"
  /// Verbs whose results may lie in the same folder: their files stay, but for those of a name that is
  /// written anew.
  std::span<const std::string_view> beside = {};
};

/// How an earlier result gives way to a new one.
enum class Replace {
  at_once,       ///< the kernel exchanges both folders; in two steps where the file system can't
  in_two_steps,  ///< the earlier one is called "TARGET.emberlock-earlier" for a moment; for file systems
                 ///< without exchange
};

struct OutputRequest {
  std::filesystem::path target;
  OutputVerb verb;
  /// What is read: none of it may be the target, lie in it, or be a folder in which the target lies.
  std::vector<std::filesystem::path> inputs = {};
  /// Inputs that may lie in the target all the same, if they are files of the earlier result, unchanged: the
  /// verb writes them anew.
  std::vector<std::filesystem::path> updated = {};
  Replace replace = Replace::at_once;
};

/// Whether a folder may be made at `target` from these inputs. Errors: bad_input, with the input that is in
/// the way. Symlinks and relative paths are seen through, and where one of these very folders is mounted
/// elsewhere too.
Status check_apart(const std::filesystem::path& target, const std::vector<std::filesystem::path>& inputs);

/// Whether `folder` is absent, or an empty folder. Errors: bad_input.
Status check_new_folder(const std::filesystem::path& folder);

/// Removes the files below `folder` (symlinks are files, and never followed) that `ours` says yes to, by
/// their path within it, then the folders that are empty. Returns whether nothing is left, `folder` itself
/// included.
bool remove_ours(const std::filesystem::path& folder,
                 const std::function<bool(const std::string& path, const struct stat& info)>& ours);

/// Every folder that a verb writes: filled in a hidden folder beside it (`path()`), and under its final name
/// only when it is complete and on the disk (`commit()`). Abandoned (destroyed without commit) it removes
/// what was written.
///
/// An existing target is refused unless it is empty, or an earlier result of this verb. Of an earlier result
/// only those files are replaced that its list names and that are as it left them; whatever else lies there
/// is carried over into the new folder (as hard links, so nothing is copied), and where it can't be, or has a
/// name that the new result needs, the target stays as it is. Killed at any moment either the earlier folder
/// or the new one stands whole, each with everything that was somebody else's.
class OutputFolder {
 public:
  /// Makes the hidden folder, and the target's parents where they are absent. The new folder has the mode of
  /// one that stands there, and its owner where that is allowed. Errors: bad_input (what is in the way, and
  /// what to do; a target that something is mounted at), io.
  static Result<OutputFolder> create(const OutputRequest& request);
  /// What create() would say; leaves nothing behind. For verbs that work for long before they write.
  static Status check(const OutputRequest& request);

  OutputFolder(OutputFolder&& o) noexcept;
  OutputFolder& operator=(OutputFolder&&) = delete;
  ~OutputFolder();

  [[nodiscard]] const std::filesystem::path& path() const { return staging_; }
  /// Lists what lies in path(), flushes it and gives it its name. Where that can't be, because the target has
  /// meanwhile come to hold what can't be carried over, or the system refuses, what stands there stays, the
  /// result is complete in "TARGET.new" and the error says so.
  Status commit();

 private:
  explicit OutputFolder(OutputRequest request) : request_(std::move(request)) {}
  /// The target as it is now, and whether the new result can still take its place.
  Status look_again(Survey& found) const;
  /// Gives the complete result a name of its own. Returns why, and where it is.
  Error leave_beside(Error why);

  OutputRequest request_;  // its target resolved
  std::filesystem::path staging_;
  std::vector<std::filesystem::path> made_;  // parents, which go again if nothing comes to lie in them
  UniqueFd lock_;                            // on the list, while it says that the result isn't finished
};

}  // namespace emberlock
