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

/// In a fixture's SetUp: skips, and says so, where there is no such folder; one that lacks a file fails.
#define SKIP_WITHOUT_RECORDINGS()                                                         \
  if (!std::filesystem::exists(emberlock::test::recordings()))                            \
  GTEST_SKIP() << "no recordings in " << emberlock::test::recordings().lexically_normal() \
               << ": set EMBERLOCK_DATA to their folder"
