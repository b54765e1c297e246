// SPDX-License-Identifier: Apache-2.0
// A session that version 0.1.0 imported becomes a volume.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recording.h"
#include "tests/support/shell.h"

namespace emberlock {
namespace {

TEST(UpgradeProgram, ASessionOfTheFirstVersionIsReconstructed) {
  const test::TempFolder temp;
  const Shell done = shell(std::string(EMBERLOCK_PROGRAM) +
                           " reconstruct " EMBERLOCK_SOURCE_DIR
                           "/tests/files/session_0.1.0/calibrated --frame 1 --voxels 16 --device cpu --out " +
                           (temp / "result").string());
  EXPECT_EQ(done.status, 0) << done.output;
  EXPECT_TRUE(std::filesystem::exists(temp / "result/volume.vdb"));
}

}  // namespace
}  // namespace emberlock
