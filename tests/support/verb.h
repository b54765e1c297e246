// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace emberlock::test {

struct VerbRun {
  int exit_code = 0;
  std::string out;
  std::string err;
};

/// `emberlock WORDS...`, as main() runs it, with the one verb that `add` adds.
inline VerbRun run_verb(void (*add)(CLI::App&), std::vector<std::string> words) {
  std::reverse(words.begin(), words.end());  // CLI11 takes them last first
  CLI::App app{"", "emberlock"};
  add(app);
  VerbRun result;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  try {
    app.parse(words);
  } catch (const CLI::RuntimeError& e) {
    result.exit_code = e.get_exit_code();
  } catch (const CLI::ParseError& e) {
    result.exit_code = 2;
    result.err = e.what();
  }
  result.out = testing::internal::GetCapturedStdout();
  result.err += testing::internal::GetCapturedStderr();
  return result;
}

/// For these words, with nothing left at `out`, nor half written beside it.
inline void expect_refused(const VerbRun& run, const std::string& words, const std::filesystem::path& out) {
  EXPECT_EQ(run.exit_code, 2) << run.out;
  EXPECT_THAT(run.err, testing::HasSubstr(words));
  EXPECT_FALSE(std::filesystem::exists(out));
  for (const auto& entry : std::filesystem::directory_iterator(out.parent_path()))
    EXPECT_THAT(entry.path().filename().string(), testing::Not(testing::HasSubstr(out.filename().string())))
        << "half written";
}

}  // namespace emberlock::test
