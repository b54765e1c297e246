// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock::daemon {

/// The console as it was built, read once: a request only looks up a name, so no path leads anywhere else.
class ConsoleFiles {
 public:
  struct File {
    std::string content;
    std::string_view type;     ///< for Content-Type
    std::string tag;           ///< for ETag: of the content
    std::string_view caching;  ///< for Cache-Control
  };
  static constexpr std::size_t kLargest = std::size_t{64} << 20;  ///< bytes, all together

  ConsoleFiles() = default;
  /// Only files that are there, no links. A folder that isn't there is an error that says so.
  static Result<ConsoleFiles> read(const std::filesystem::path& folder);

  /// By the path of a URL, "/" being "/index.html"; null: there is none.
  [[nodiscard]] const File* find(std::string_view path) const;

 private:
  std::map<std::string, File, std::less<>> files_;
};

}  // namespace emberlock::daemon
