// SPDX-License-Identifier: Apache-2.0
// The least that a verb is (CONTRIBUTING.md, "A verb"): options into a struct, the work in another room,
// errors by fail().
#include <cstdio>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "cli/commands.h"
#include "session/reader.h"
#include "tests/support/recording.h"

namespace emberlock::cli {
namespace {

struct CountArguments {
  std::string session;
};

void count_frames(const CountArguments& arguments) {
  const session::SessionReader reader = or_fail(session::SessionReader::open(arguments.session));
  std::printf("%zu cameras\n", reader.camera_count());
}

void add_count(const Verb& app) {
  auto arguments = std::make_shared<CountArguments>();
  const Verb verb = app.add_verb("count", "Says how many cameras a session has");
  verb.add_option("SESSION", arguments->session, "The session's folder").require();
  verb.set_action([arguments] { count_frames(*arguments); });
}

TEST(ExampleVerb, PrintsOnStdoutAndLeavesWithTwoWhereItsInputIsBad) {
  const test::TempFolder temp;
  test::record(temp / "take", {{64, 48}, PixelFormat::gray8, 8}, 5, test::small_disk_options());
  const CommandLine line;
  add_count(line.program());
  testing::internal::CaptureStdout();
  line.parse({"count", (temp / "take").string()});
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "1 cameras\n");
  testing::internal::CaptureStderr();
  try {
    line.parse({"count", (temp / "none").string()});
    ADD_FAILURE() << "went on";
  } catch (const Exit& left) {
    EXPECT_NE(left.code, 0);
  }
  EXPECT_NE(testing::internal::GetCapturedStderr().find("none"), std::string::npos);
}

}  // namespace
}  // namespace emberlock::cli
