// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <csignal>
#include <filesystem>
#include <system_error>
#include <thread>

#include <gmock/gmock.h>

#include "cli/commands.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"
#include "tests/support/wait.h"

namespace emberlock::cli {
namespace {
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(AlignVerb, PrintsChangesAloneAndTheCamerasOnTheirCircle) {
  const auto brief = test::run_verb(add_align, {"align", "--rig", "virtual:2", "--seed", "1"});
  ASSERT_EQ(brief.exit_code, 0) << brief.err;
  EXPECT_THAT(brief.out, ContainsRegex("round [0-9]+: .*; resets virtual-0[0-9] \\([+-][0-9.]+ rows\\)\n"));
  EXPECT_THAT(brief.out, Not(HasSubstr("leave it")));
  EXPECT_THAT(brief.out, HasSubstr("aligned after"));
  EXPECT_THAT(brief.out, HasSubstr("to a turn"));
  EXPECT_THAT(brief.out, ContainsRegex("a virtual-00 +[+-][0-9.]+ rows"));
  const auto whole = test::run_verb(add_align, {"align", "--rig", "virtual:2", "--seed", "1", "--verbose"});
  EXPECT_THAT(whole.out, HasSubstr("leave it"));
  EXPECT_GT(std::ranges::count(whole.out, '\n'), std::ranges::count(brief.out, '\n'));
  // Each offset stands once in a line.
  EXPECT_THAT(whole.out, Not(ContainsRegex("rows[^\n]*reads [0-9.]+ rows")));
}

TEST(AlignVerb, CtrlCKeepsWhatWasRecordedAndSaysWhat) {
  const test::TempFolder temp;
  const std::filesystem::path record = temp / "run";
  // Within reach of nothing but luck, and allowed to try for long. Some rounds are recorded first.
  std::thread presses([&] {
    static_cast<void>(test::wait_until([&] {
      std::error_code absent;
      const auto bytes = std::filesystem::file_size(record / "events.binpb", absent);
      return !absent && bytes > 350;
    }));
    ::raise(SIGINT);
  });
  const auto run = test::run_verb(
      add_align, {"align", "--rig", "virtual:3", "--tolerance", "2rows", "--max-rounds", "1000000",
                  "--max-resets", "1000000", "--max-minutes", "1000000", "--probability", "0.01", "--record",
                  record.string(), "--delays", (temp / "delays.json").string()});
  presses.join();
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.out, HasSubstr("stopped after round "));
  EXPECT_THAT(run.out, HasSubstr("rounds in " + record.string()));
  EXPECT_THAT(run.out, HasSubstr("reset delays of "));
  EXPECT_TRUE(std::filesystem::exists(temp / "delays.json"));
  const auto replay = test::run_verb(add_align, {"align", "--replay", record.string()});
  EXPECT_EQ(replay.exit_code, 1) << "as it was: not aligned";
  EXPECT_THAT(replay.out, HasSubstr("NOT aligned after"));
}

}  // namespace
}  // namespace emberlock::cli
