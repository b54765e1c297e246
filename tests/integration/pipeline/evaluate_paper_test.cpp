// SPDX-License-Identifier: Apache-2.0
// The quick variant of `evaluate paper`, with bounds that hold of it.
#include "evaluate/paper/evaluate_paper.h"

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include <gmock/gmock.h>

#include "base/clock.h"
#include "base/file.h"
#include "cli/commands.h"
#include "cli/machine.h"
#include "evaluate/methods.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
using testing::HasSubstr;

TEST(EvaluatePaper, ItsTablesHoldAndWhatIsDoneIsNotDoneAgain) {
  const test::TempFolder temp;
  const std::string out = (temp / "paper").string();
  // Somebody else's file stays.
  std::filesystem::create_directories(out);
  std::ofstream(out + "/notes.txt") << "mine";
  const auto first = test::run_verb(add_evaluate, {"evaluate", "paper", "--quick", "--device", "cpu",
                                                   "--only", "nine-views", "--out", out});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr("as-soot-glows, the tenth view"));
  const auto all =
      test::run_verb(add_evaluate, {"evaluate", "paper", "--quick", "--device", "cpu", "--out", out});
  ASSERT_EQ(all.exit_code, 0) << all.err;
  EXPECT_EQ(*read_file(out + "/notes.txt"), "mine");

  evaluate::PaperOptions options;
  options.extent = evaluate::Extent::quick;
  options.compute.device = recon::Device::cpu;
  options.machine = machine(0, "cpu");
  const SteadyClock clock;
  const auto again = evaluate::evaluate_paper(options, out, clock);
  ASSERT_TRUE(again.ok()) << again.error().message();
  EXPECT_EQ(again->taken_up, static_cast<int>(again->runs.size()));
  std::map<std::string, const evaluate::MethodRun*> of;
  for (const evaluate::MethodRun& run : again->runs) {
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
  const std::vector<std::string> words = {"evaluate",    "paper", "--quick", "--device", "cpu",
                                          "--only",      "smoke", "--cells", "32",       "--methods",
                                          "the paper's", "--out", out};
  ASSERT_EQ(test::run_verb(add_evaluate, words).exit_code, 0);
  std::vector<std::string> others = words;
  others.insert(others.end(), {"--voxels", "24"});
  const auto refused = test::run_verb(add_evaluate, others);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("other settings"));
  const auto none = test::run_verb(
      add_evaluate, {"evaluate", "paper", "--only", "smoke", "--methods", "Gaussian splats", "--out", out});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("none of these methods"));
  EXPECT_THAT(test::run_verb(add_evaluate, {"evaluate", "paper", "--only", "x", "--out", out}).err,
              HasSubstr("iterations, nine-views"));
  EXPECT_THAT(test::run_verb(add_evaluate, {"evaluate", "paper", "--methods", "x", "--out", out}).err,
              HasSubstr("emberlock"));
}

}  // namespace
}  // namespace emberlock::cli
