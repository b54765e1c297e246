// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/command_line.h"

namespace emberlock::test {

struct VerbRun {
  int exit_code = 0;
  std::string out;
  std::string err;
};

/// `emberlock WORDS...`, as main() runs it, with the one verb that `add` adds.
using AddVerb = void (*)(const cli::Verb&);
inline VerbRun run_verb(AddVerb add, std::vector<std::string> words) {
  const cli::CommandLine line;
  add(line.program());
  VerbRun result;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  try {
    line.parse(std::move(words));
  } catch (const cli::Exit& e) {
    result.exit_code = e.code;
  } catch (const cli::UsageError& e) {
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
