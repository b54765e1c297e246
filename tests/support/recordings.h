// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>

namespace emberlock::test {

/// Where real recordings lie: EMBERLOCK_DATA, else ../shared/data beside the project.
inline std::filesystem::path recordings() {
  const char* folder = std::getenv("EMBERLOCK_DATA");
  if (folder != nullptr) return folder;
  return std::filesystem::path(EMBERLOCK_SOURCE_DIR) / ".." / "shared" / "data";
}

}  // namespace emberlock::test
