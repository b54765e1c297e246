// SPDX-License-Identifier: Apache-2.0
// `emberlock batch` before and around the work: what it refuses, and how it asks Slurm, whose programs are
// scripts here. The work itself: tests/integration/batch.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "base/file.h"
#include "cli/batch_progress.h"
#include "cli/batch_slurm.h"
#include "cli/commands.h"
#include "recon/batch/ledger.h"
#include "recon/batch/plan.h"
#include "tests/support/recording.h"
#include "tests/support/shell.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class BatchCommandTest : public testing::Test {
 protected:
  void SetUp() override {
    test::record(session_, {{64, 48}, PixelFormat::gray8, 8}, 5, test::small_disk_options());
    fs::create_directory(bin_);
    path_ = std::getenv("PATH");
    ::setenv("PATH", bin_.c_str(), 1);
  }
  void TearDown() override { ::setenv("PATH", path_.c_str(), 1); }

  [[nodiscard]] test::VerbRun run(const std::vector<std::string>& further, const char* verb = "") const {
    std::vector<std::string> words{"batch"};
    if (*verb != '\0') words.emplace_back(verb);
    words.insert(words.end(), {session_.string(), "--out", out_.string()});
    words.insert(words.end(), further.begin(), further.end());
    return test::run_verb(add_batch, words);
  }
  void install(const char* program, const std::string& script) const {
    std::ofstream(bin_ / program) << "#!/bin/bash\n" << script << "\n";
    ::chmod((bin_ / program).c_str(), 0755);
  }

  test::TempFolder temp_;
  const fs::path session_ = temp_ / "session", out_ = temp_ / "out", bin_ = temp_ / "bin";
  std::string path_;
};

TEST_F(BatchCommandTest, FramesBeyondTheRecordingAreRefused) {
  test::expect_refused(run({"--frames", "0:5"}), "there is no frame 5: the session has 5", out_);
  test::expect_refused(run({"--frames", "3:1"}), "lies before the first frame", out_);
  test::expect_refused(run({"--frames", "3"}), "give FIRST:LAST", out_);
  test::expect_refused(run({}), "--frames", out_);
  test::expect_refused(run({"--frames", "0:9"}, "submit"), "there is no frame 9", out_);
}

TEST_F(BatchCommandTest, WhatAClockEndsIsNoOption) {
  test::expect_refused(run({"--frames", "0:1", "--budget", "3"}), "--budget", out_);
  test::expect_refused(run({"--frames", "0:1", "--target-rmse", "3"}), "--target-rmse", out_);
}

TEST_F(BatchCommandTest, AFolderThatHoldsOtherThingsIsLeftAlone) {
  fs::create_directory(out_);
  std::ofstream(out_ / "letter.txt") << "dear";
  const auto refused = run({"--frames", "0:1", "--voxels", "8"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("holds \"letter.txt\", and no batch"));
  EXPECT_FALSE(fs::exists(out_ / "batch"));
}

TEST_F(BatchCommandTest, TheLedgerOfSomethingElseIsRefused) {
  // Frames of these cameras, which have no calibration, fail; the ledger is made all the same.
  EXPECT_EQ(run({"--frames", "0:1", "--voxels", "8"}).exit_code, 1);
  ASSERT_TRUE(fs::exists(out_ / "batch" / "plan.json"));
  const auto refused = [&](const std::vector<std::string>& words) {
    const auto result = run(words);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    return result.err;
  };
  EXPECT_THAT(refused({"--frames", "0:2", "--voxels", "8"}),
              HasSubstr("holds a batch of frames 0:1, not 0:2"));
  EXPECT_THAT(refused({"--frames", "0:1", "--voxels", "9"}), HasSubstr("--voxels was \"8\", and is \"9\""));
  EXPECT_THAT(refused({"--frames", "0:1"}), HasSubstr("--voxels was \"8\", and is not given"));
  EXPECT_THAT(refused({"--frames", "0:1", "--voxels", "8", "--chunk", "1"}), HasSubstr("chunks of 5 frames"));
  test::record(temp_ / "another", {{64, 48}, PixelFormat::gray8, 8}, 4, test::small_disk_options());
  const auto another = test::run_verb(add_batch, {"batch", (temp_ / "another").string(), "--out",
                                                  out_.string(), "--frames", "0:1", "--voxels", "8"});
  EXPECT_EQ(another.exit_code, 2);
  EXPECT_THAT(another.err, HasSubstr("holds a batch of another session"));
  std::ofstream(out_ / "batch" / "plan.json") << "{}";
  EXPECT_THAT(refused({"--frames", "0:1", "--voxels", "8"}), HasSubstr("plan.json"));
}

TEST_F(BatchCommandTest, FramesThatFailAreToldAndTriedAgain) {
  const std::vector<std::string> words{"--frames", "0:1", "--voxels", "8"};
  const auto first = run(words);
  EXPECT_EQ(first.exit_code, 1);
  EXPECT_THAT(first.err, HasSubstr("frame 0: "));
  EXPECT_THAT(first.err, HasSubstr("of 2 frames 2 failed"));
  EXPECT_TRUE(fs::exists(out_ / "sequence" / "report.html"));
  const auto again = run(words);
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.err, HasSubstr("frame 1: "));
}

TEST_F(BatchCommandTest, SubmitWritesAScriptThatOutlivesNodesAndStatusTellsOfTheJob) {
  install("sbatch", "echo \"$@\" > " + (temp_ / "asked").string() + "; echo '17;cluster'");
  const auto submitted =
      run({"--frames", "1:3", "--voxels", "8", "--keep-poses", "--effects", "none", "--nodes", "3", "--ranks",
           "2", "--gpus", "1", "--time", "5:00", "--sbatch=--partition=main", "--sbatch=--mem=1G"},
          "submit");
  ASSERT_EQ(submitted.exit_code, 0) << submitted.err;
  EXPECT_THAT(submitted.out, HasSubstr("job              17\n"));
  const std::string asked = read_file(temp_ / "asked").value();
  EXPECT_THAT(asked, HasSubstr("--parsable"));
  const std::string script = read_file(out_ / "slurm" / "batch.sbatch").value();
  for (const char* line : {"--nodes=3\n", "--ntasks-per-node=2\n", "--gpus-per-node=1\n", "--time=5:00\n",
                           "--partition=main\n", "--mem=1G\n", "--no-kill\n", "--requeue\n"})
    EXPECT_THAT(script, HasSubstr(std::string("#SBATCH ") + line));
  EXPECT_THAT(script, HasSubstr(" batch " + session_.string() + " --frames '1:3' --out " + out_.string() +
                                " --voxels 8"));
  EXPECT_THAT(script, HasSubstr(" --keep-poses"));
  EXPECT_THAT(script, Not(HasSubstr(" --nodes ")));

  const auto status = [&] { return test::run_verb(add_batch, {"batch", "status", out_.string()}); };
  install("squeue", "echo \"$@\" > " + (temp_ / "asked").string() + "; echo 'RUNNING for 1:02'");
  EXPECT_THAT(status().out, HasSubstr("17 RUNNING for 1:02"));
  EXPECT_THAT(read_file(temp_ / "asked").value(), HasSubstr("--jobs=17"));
  install("squeue", "echo 'slurm_load_jobs error: Invalid job id specified' >&2; exit 1");
  EXPECT_THAT(status().out, HasSubstr("17 has left the queue"));
  install("squeue", "echo 'Unable to contact slurm controller' >&2; exit 1");
  EXPECT_EQ(status().exit_code, 1);
  EXPECT_THAT(status().err, HasSubstr("squeue failed: Unable to contact slurm controller"));
}

TEST_F(BatchCommandTest, SlurmThatIsNotThereOrRefusesIsTold) {
  const std::vector<std::string> words{"--frames", "0:1"};
  const auto absent = run(words, "submit");
  EXPECT_EQ(absent.exit_code, 1);
  EXPECT_THAT(absent.err, HasSubstr("sbatch: isn't installed here"));
  EXPECT_TRUE(fs::exists(out_ / "slurm" / "batch.sbatch")) << "to be submitted by hand";
  install("sbatch", "echo 'sbatch: error: invalid partition' >&2; exit 1");
  const auto refused = run(words, "submit");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("invalid partition"));
  EXPECT_FALSE(fs::exists(out_ / "slurm" / "job"));
  const auto status = test::run_verb(add_batch, {"batch", "status", out_.string()});
  EXPECT_EQ(status.exit_code, 2);
  EXPECT_THAT(status.err, HasSubstr("holds no batch"));
}

/// The shell reads the script's words as they were.
TEST_F(BatchCommandTest, WordsOfAScriptMayHoldAnything) {
  ::setenv("PATH", path_.c_str(), 1);
  std::string script = sbatch_script({}, {"a b", "it's", "", "$HOME", "\"q\""}, temp_ / "100%o");
  EXPECT_THAT(script, HasSubstr("100%%o/slurm/job-%j.txt"));
  const std::size_t command = script.find("exec srun");
  std::ofstream(temp_ / "s") << "srun() { while [[ $1 == --* ]]; do shift; done; printf '%s\\n' \"$@\"; }\n"
                             << script.substr(command + 5);
  EXPECT_EQ(shell("bash " + (temp_ / "s").string()).output, "a b\nit's\n\n$HOME\n\"q\"\n");
}

TEST(BatchProgressTest, TimeLeftFollowsFromTheRateSinceTheBegin) {
  EXPECT_EQ(progress_words(100, 1000, 0, Seconds(10)), "100 of 1000 frames") << "nothing is known yet";
  EXPECT_EQ(progress_words(100, 1000, 50, Seconds(10)),
            "100 of 1000 frames, 5 frames a second, 3 min 0 s left");
  EXPECT_EQ(progress_words(999, 1000, 1, Seconds(30)),
            "999 of 1000 frames, 0.033 frames a second, 30 s left");
  EXPECT_EQ(progress_words(1000, 1000, 1000, Seconds(30)), "1000 of 1000 frames");
  EXPECT_THAT(progress_words(1, 10001, 1, Seconds(1)), HasSubstr("2 h 46 min left"));
}

}  // namespace
}  // namespace emberlock::cli
