// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
using testing::HasSubstr;

TEST(BenchVerb, RefusesARigThatCannotBeBeforeItMeasures) {
  const auto refused = [](std::vector<std::string> more) {
    more.insert(more.begin(), "bench");
    const test::VerbRun run = test::run_verb(add_bench, more);
    EXPECT_EQ(run.exit_code, 2) << run.out;
    EXPECT_EQ(run.out, "");
    return run.err;
  };
  EXPECT_THAT(refused({"--cameras", "1"}), HasSubstr("--cameras"));
  EXPECT_THAT(refused({"--size", "large"}), HasSubstr("--size"));
  EXPECT_THAT(refused({"--fps", "0"}), HasSubstr("--fps"));
  EXPECT_THAT(refused({"--voxels", "4000"}), HasSubstr("--voxels"));
  EXPECT_THAT(refused({"--device", "abacus"}), HasSubstr("cuda"));
  EXPECT_THAT(refused({"--threads", "1000"}), HasSubstr("--threads"));
}

TEST(BenchVerb, ADiskThatCannotBeWrittenIsNamed) {
  const test::VerbRun run = test::run_verb(add_bench, {"bench", "--disk", "/nowhere/at/all"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("/nowhere/at/all"));
}

}  // namespace
}  // namespace emberlock::cli
