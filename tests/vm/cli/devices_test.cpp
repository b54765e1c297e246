// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/shell.h"
#include "tests/support/wait.h"
#include "tests/vm/v4l2/vivid.h"

// The program itself, with cameras of the kernel's vivid plugged in.
namespace emberlock {
namespace {

using testing::HasSubstr;

class DevicesVerb : public Vivid {
 protected:
  DevicesVerb() : Vivid(2) {}
  static Shell emberlock(const std::string& words) {
    return shell("(" + std::string(EMBERLOCK_PROGRAM) + " devices " + words + ")");
  }
};

TEST_F(DevicesVerb, ListsTheCamerasThatAreThereAndWhoHoldsThem) {
  const auto held = filming(id(1));
  const Shell run = emberlock("--json");
  ASSERT_EQ(run.status, 0) << run.output;
  const auto json = nlohmann::json::parse(run.output);
  ASSERT_EQ(json["cameras"].size(), 2) << run.output;
  const auto& free = json["cameras"][0];
  EXPECT_EQ(free["id"], id(0));
  EXPECT_EQ(free["driver"], "v4l2");
  EXPECT_EQ(free["held_by"], nullptr);
  EXPECT_GT(free["modes"].size(), 10);
  EXPECT_EQ(json["cameras"][1]["held_by"]["program"], "vm_cli");
}

TEST_F(DevicesVerb, ProbesACameraAndTimesItsResets) {
  const Shell run =
      emberlock("probe " + id(0) + " --size 640x360 --rate 15 --seconds 2 --resets 3 --json 2>/dev/null");
  const auto json = nlohmann::json::parse(run.output);
  EXPECT_NEAR(json["frame_rate_hz"].get<double>(), 15, .3) << run.output;
  EXPECT_GT(json["counts"]["delivered"].get<int>(), 20) << run.output;
  EXPECT_GT(json["reset_mean_s"].get<double>(), 0) << run.output;
}

TEST_F(DevicesVerb, WatchSaysWhatWentAndWhatCame) {
  const std::string heard = testing::TempDir() + "watched";
  const std::string command = std::string(EMBERLOCK_PROGRAM) + " devices watch >" + heard + " 2>&1 & echo $!";
  const std::string process = shell(command).output;
  const auto said = [&](const std::string& words) {
    return test::wait_until([&] { return shell("grep -q '" + words + "' " + heard).status == 0; });
  };
  EXPECT_TRUE(said(id(1))) << shell("cat " + heard).output;
  unplug();
  EXPECT_TRUE(said("gone: " + id(1))) << shell("cat " + heard).output;
  plug_in();
  EXPECT_TRUE(said("came:")) << shell("cat " + heard).output;
  EXPECT_EQ(shell("kill -INT " + process).status, 0);
}

}  // namespace
}  // namespace emberlock
