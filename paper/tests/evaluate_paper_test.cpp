// SPDX-License-Identifier: Apache-2.0
// The quick variant of `evaluate paper`, with bounds that hold of it.
#include "paper/evaluate_paper.h"

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "base/clock.h"
#include "base/file.h"
#include "evaluate/machine.h"
#include "paper/command.h"
#include "paper/methods.h"
#include "tests/support/recording.h"

namespace emberlock::paper {
namespace {
using testing::HasSubstr;

struct CommandRun {
  int exit_code = 0;
  std::string out;
  std::string err;
};
CommandRun run_program(const std::vector<std::string>& words) {
  std::vector<const char*> argv{"emberlock-paper"};
  for (const std::string& word : words) argv.push_back(word.c_str());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  const int exit_code = run_command(static_cast<int>(argv.size()), argv.data());
  std::string out = testing::internal::GetCapturedStdout();
  return {exit_code, out, testing::internal::GetCapturedStderr()};
}

TEST(EvaluatePaper, ItsTablesHoldAndWhatIsDoneIsNotDoneAgain) {
  const test::TempFolder temp;
  const std::string out = (temp / "paper").string();
  // Somebody else's file stays.
  std::filesystem::create_directories(out);
  std::ofstream(out + "/notes.txt") << "mine";
  const auto first = run_program({"--quick", "--device", "cpu", "--only", "nine-views", "--out", out});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr("as-soot-glows, the tenth view"));
  const auto all = run_program({"--quick", "--device", "cpu", "--out", out});
  ASSERT_EQ(all.exit_code, 0) << all.err;
  EXPECT_EQ(*read_file(out + "/notes.txt"), "mine");

  PaperOptions options;
  options.extent = Extent::quick;
  options.compute.device = recon::Device::cpu;
  options.machine = evaluate::machine(0, "cpu");
  const SteadyClock clock;
  const auto again = evaluate_paper(options, out, clock);
  ASSERT_TRUE(again.ok()) << again.error().message();
  EXPECT_EQ(again->taken_up, static_cast<int>(again->runs.size()));
  std::map<std::string, const MethodRun*> of;
  for (const MethodRun& run : again->runs) {
    EXPECT_EQ(run.failed, "") << run.of << ", " << run.method;
    of[run.of + " " + run.method] = &run;
  }
  const auto error = [&](const char* name) { return of.at(name)->errors.test[0]; };
  EXPECT_LT(error("as-the-paper-renders emberlock"), error("as-the-paper-renders the paper's"));
  EXPECT_LT(error("16-cameras emberlock"), error("4-cameras emberlock") / 2);
  EXPECT_LT(of.at("16-cameras emberlock")->temperature->median, 40);
  EXPECT_LT(of.at("16-cameras emberlock")->temperature->median,
            of.at("4-cameras emberlock")->temperature->median);
  EXPECT_LT(of.at("ten-cameras the paper's")->points.back().errors.test[0],
            0.75 * of.at("ten-cameras the paper's")->points.front().errors.test[0]);

  const std::string page = *read_file(out + "/report/index.html");
  EXPECT_THAT(page, HasSubstr("79.3 / 47.9 / 28.9"));
  EXPECT_THAT(page, HasSubstr("How the scenes differ"));
}

TEST(EvaluatePaper, AFolderOfOtherSettingsIsRefused) {
  const test::TempFolder temp;
  const std::string out = (temp / "paper").string();
  const std::vector<std::string> words = {"--quick", "--device",  "cpu",         "--only", "smoke", "--cells",
                                          "32",      "--methods", "the paper's", "--out",  out};
  ASSERT_EQ(run_program(words).exit_code, 0);
  std::vector<std::string> others = words;
  others.insert(others.end(), {"--voxels", "24"});
  const auto refused = run_program(others);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("other settings"));
  const auto none = run_program({"--only", "smoke", "--methods", "Gaussian splats", "--out", out});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("none of these methods"));
  EXPECT_THAT(run_program({"--only", "x", "--out", out}).err, HasSubstr("iterations, nine-views"));
  EXPECT_THAT(run_program({"--methods", "x", "--out", out}).err, HasSubstr("emberlock"));
}

}  // namespace
}  // namespace emberlock::paper
