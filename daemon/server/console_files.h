// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock::daemon {

/// The files of the built console, read once. A request only looks up a name, so no path can leave the
/// folder.
class ConsoleFiles {
 public:
  struct File {
    std::string content;
    std::string_view type;     ///< for Content-Type
    std::string tag;           ///< for ETag: a hash of the content
    std::string_view caching;  ///< for Cache-Control
  };
  static constexpr std::size_t kLargest = std::size_t{64} << 20;  ///< total bytes

  ConsoleFiles() = default;
  /// Reads existing regular files, without links. Error: the folder doesn't exist.
  static Result<ConsoleFiles> read(const std::filesystem::path& folder);

  /// The file for a URL's path; "/" is "/index.html". Null if there is none.
  [[nodiscard]] const File* find(std::string_view path) const;

 private:
  std::map<std::string, File, std::less<>> files_;
};

}  // namespace emberlock::daemon
