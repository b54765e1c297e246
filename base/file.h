#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock {

/// The whole file; an Error that names it otherwise. Refuses files above `max_bytes`.
Result<std::string> read_file(const std::filesystem::path& path,
                              std::size_t max_bytes = std::size_t{1} << 30);

/// Writes beside the target, flushes to disk, then renames: a reader sees the old content or the new, never
/// half.
Status write_file_atomically(const std::filesystem::path& path, std::string_view content);

/// A directory that appears under its final name only when it is complete: fill `path()`, then `commit()`.
/// Abandoned (destroyed without commit) it removes what was written. An existing target is replaced at commit
/// only if it is empty or holds a file named `marker` (so that a mistyped --out never eats a user's folder).
class AtomicDirectory {
 public:
  static Result<AtomicDirectory> create(const std::filesystem::path& target, std::string_view marker);
  AtomicDirectory(AtomicDirectory&& o) noexcept;
  AtomicDirectory& operator=(AtomicDirectory&&) = delete;
  ~AtomicDirectory();

  [[nodiscard]] const std::filesystem::path& path() const { return staging_; }
  Status commit();

 private:
  AtomicDirectory(std::filesystem::path target, std::filesystem::path staging)
      : target_(std::move(target)), staging_(std::move(staging)) {}
  std::filesystem::path target_;
  std::filesystem::path staging_;
};

}  // namespace emberlock
