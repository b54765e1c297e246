// SPDX-License-Identifier: Apache-2.0
// The program takes what version 0.2.0 imported and recorded.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recording.h"
#include "tests/support/shell.h"

namespace emberlock {
namespace {

using testing::HasSubstr;

Shell emberlock_with(const std::string& words) { return shell(std::string(EMBERLOCK_PROGRAM) + " " + words); }

TEST(UpgradeProgram, ASessionOfAnEarlierVersionIsReconstructed) {
  const test::TempFolder temp;
  const Shell done =
      emberlock_with("reconstruct " EMBERLOCK_SOURCE_DIR
                     "/tests/files/session_0.2.0/calibrated --frame 1 --voxels 16 --device cpu --out " +
                     (temp / "result").string());
  EXPECT_EQ(done.status, 0) << done.output;
  EXPECT_TRUE(std::filesystem::exists(temp / "result/volume.vdb"));
}

TEST(UpgradeProgram, AnAlignmentOfAnEarlierVersionIsReplayed) {
  const Shell done =
      emberlock_with("align --replay " EMBERLOCK_SOURCE_DIR "/tests/files/session_0.2.0/alignment/timed");
  EXPECT_EQ(done.status, 0) << done.output;
  EXPECT_THAT(done.output, HasSubstr("aligned"));
}

}  // namespace
}  // namespace emberlock
