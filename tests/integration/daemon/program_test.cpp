// SPDX-License-Identifier: Apache-2.0
// The programs as an operator runs them: emberlockd, killed and started again, and `emberlock` as its client.
#include <csignal>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "tests/support/daemon_test.h"

namespace emberlock {
namespace {

using ::testing::HasSubstr;

class DaemonProgram : public test::DaemonTest {
 protected:
  DaemonProgram() : DaemonTest({.cameras = 4, .size = "320x240", .strobe = "virtual"}) {}
  /// `emberlock record NAME` on a thread of its own, once the cameras film.
  std::thread record(const std::string& name) const {
    EXPECT_TRUE(answers("status", "filming"));
    std::thread recording([this, name] { static_cast<void>(client("record " + name + " --unlocked")); });
    EXPECT_TRUE(answers("status", "recording  " + name));
    return recording;
  }
};

TEST_F(DaemonProgram, KilledInMidRecordingItLosesASecondAtMostAndTheNextOneSalvagesTheRest) {
  constexpr double kSecond = 4 * 24;  // frames of all cameras
  double arrived = 0;
  double safe = 0;
  {
    test::Program daemon(command());
    std::thread recording = record("killed");
    // A busy machine may be behind for a while.
    EXPECT_TRUE(test::wait_until([&] {
      const nlohmann::json now = this->recording();
      const nlohmann::json progress = now.value("progress", nlohmann::json::object());
      arrived = number(progress, "arrived");
      safe = number(now, "frames");
      return safe > kSecond && number(progress, "at_risk_s") < 1;
    }));
    EXPECT_EQ(daemon.end(SIGKILL), -SIGKILL);
    recording.join();
  }
  test::Program again(command());
  ASSERT_TRUE(answers("sessions list", "SALVAGED"));
  const session::SessionCheck check = expect_whole("killed");
  EXPECT_EQ(check.state, v1::Manifest::SALVAGED);
  ASSERT_EQ(check.cameras.size(), 4U);
  double kept = 0;
  for (const session::CameraCheck& camera : check.cameras) {
    EXPECT_GT(camera.good, 0U);
    kept += static_cast<double>(camera.good);
  }
  EXPECT_GE(kept, safe) << "what was called recorded";
  EXPECT_GE(kept + kSecond, arrived);
}

TEST_F(DaemonProgram, ASecondOneEndsAtOnceAndNamesTheFirst) {
  test::Program daemon(command());
  ASSERT_TRUE(answers("status", "filming"));
  const Shell second = shell(std::string(EMBERLOCKD_PROGRAM) + " --config " + config());
  EXPECT_NE(second.status, 0);
  EXPECT_THAT(second.output, HasSubstr("pid"));
  EXPECT_EQ(client("status").status, 0);
}

TEST_F(DaemonProgram, AskedToEndItFinishesItsRecording) {
  test::Program daemon(command());
  std::thread recording = record("ended");
  EXPECT_TRUE(every_camera_has(2, "ended"));
  EXPECT_EQ(daemon.end(SIGTERM), 0);
  recording.join();
  EXPECT_EQ(expect_whole("ended").state, v1::Manifest::COMPLETE);
}

TEST_F(DaemonProgram, FromColdToALockedRecordingByTheCommandLine) {
  test::Program daemon(command());
  ASSERT_TRUE(answers("status", "filming"));
  const Shell align = client("align --tolerance 60rows");
  ASSERT_EQ(align.status, 0) << align.output;
  const Shell record = client("record take --seconds 1");
  EXPECT_EQ(record.status, 0) << record.output;
  EXPECT_THAT(record.output, HasSubstr("none lost"));
  EXPECT_EQ(client("sessions verify take").status, 0);
  const Shell refused = client("record take --seconds 1");
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.output, HasSubstr("take"));
}

TEST_F(DaemonProgram, ItsLogIsAsTheConfigurationSays) {
  std::string text = *read_file(config());
  constexpr std::string_view kNowhere = "http_listen = \"\"\n";
  text.replace(text.find(kNowhere), kNowhere.size(),
               "http_listen = \"127.0.0.1:0\"\n[log]\nformat = \"json\"\n");
  std::ofstream(config()) << text;
  const std::string log = temp_ / "log";
  test::Program daemon(command(), {}, log);
  const auto said = [&] { return std::filesystem::exists(log) ? test::bytes_of(log) : std::string(); };
  EXPECT_TRUE(test::wait_until([&] { return said().find("http://127.0.0.1:") != std::string::npos; }));
  EXPECT_EQ(daemon.end(SIGTERM), 0);
  std::istringstream lines(said());
  bool says_where = false;
  for (std::string line; std::getline(lines, line);) {
    const auto told = nlohmann::json::parse(line, nullptr, false);
    ASSERT_TRUE(told.is_object()) << line;
    says_where =
        says_where || told["message"].get<std::string>().find("http://127.0.0.1:") != std::string::npos;
  }
  EXPECT_TRUE(says_where);
}

}  // namespace
}  // namespace emberlock
