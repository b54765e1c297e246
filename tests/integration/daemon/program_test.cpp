// SPDX-License-Identifier: Apache-2.0
// The programs as an operator runs them: emberlockd, killed and started again, and `emberlock` as its client.
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "session/files.h"
#include "session/index.h"
#include "session/reader.h"
#include "session/verify.h"
#include "tests/support/daemon_program.h"
#include "tests/support/daemon_test.h"
#include "tests/support/recording.h"
#include "tests/support/shell.h"

namespace emberlock {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// The one that was built.
class Program : public test::Program {
 public:
  explicit Program(const std::string& config) : test::Program(EMBERLOCKD_PROGRAM, config) {}
};

class DaemonProgram : public test::DaemonTest {
 protected:
  DaemonProgram() {
    std::ofstream(config())
        << "[rig]\nname = \"test\"\n[[rig.camera]]\ndriver = \"virtual\"\ncount = 4\nsize = \"320x240\"\n"
        << "[rig.strobe]\ndriver = \"virtual\"\n[recording]\nfolder = \"" << sessions().string()
        << "\"\nfree_space_floor_mib = 0\nencoding = \"raw\"\ntranscode = \"never\"\n[server]\nsocket = \""
        << (temp_ / "run" / "d.sock").string() << "\"\nhttp_listen = \"\"\n";
  }
  /// Of the session that is being recorded; waits for two minutes, as the machine may be busy. One that ends
  /// before isn't whole.
  [[nodiscard]] bool every_camera_has_frames(const std::string& session) const {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    for (int camera = 0; camera < 4; ++camera) {
      const auto index = session::index_path(sessions() / session, "virtual-0" + std::to_string(camera));
      std::error_code none_yet;
      while (!fs::exists(index, none_yet) ||
             fs::file_size(index, none_yet) < 2 * session::kIndexRecordBytes) {
        if (std::chrono::steady_clock::now() > end) return false;
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
      }
    }
    return true;
  }
};

TEST_F(DaemonProgram, KilledInMidRecordingItLosesASecondAtMostAndTheNextOneSalvagesTheRest) {
  std::uint64_t before = 0;
  {
    Program daemon(config());
    ASSERT_TRUE(answers("status", "filming"));
    std::thread recording([&] { static_cast<void>(client("record killed --unlocked")); });
    ASSERT_TRUE(answers("status", "recording  killed"));
    std::this_thread::sleep_for(std::chrono::seconds(2));
    before = static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
    EXPECT_EQ(daemon.end(SIGKILL), -SIGKILL);
    recording.join();
  }
  Program again(config());
  ASSERT_TRUE(answers("sessions list", "SALVAGED"));
  const auto check = session::verify_session(sessions() / "killed");
  ASSERT_TRUE(check.ok()) << check.error().message();
  EXPECT_TRUE(check->whole()) << check->to_do;
  EXPECT_EQ(check->state, v1::Manifest::SALVAGED);
  auto session = session::SessionReader::open(sessions() / "killed").value();
  for (std::size_t camera = 0; camera < 4; ++camera) {
    const auto& stamps = session.stamps(camera);
    ASSERT_FALSE(stamps.empty());
    // The stamps are of the machine's monotonic clock.
    EXPECT_LT(static_cast<double>(before) - static_cast<double>(stamps.back().monotonic_time.ns), 1e9);
  }
}

TEST_F(DaemonProgram, ASecondOneEndsAtOnceAndNamesTheFirst) {
  Program daemon(config());
  ASSERT_TRUE(answers("status", "filming"));
  const Shell second = shell(std::string(EMBERLOCKD_PROGRAM) + " --config " + config());
  EXPECT_NE(second.status, 0);
  EXPECT_THAT(second.output, HasSubstr("pid"));
  EXPECT_EQ(client("status").status, 0);
}

TEST_F(DaemonProgram, AskedToEndItFinishesItsRecording) {
  Program daemon(config());
  ASSERT_TRUE(answers("status", "filming"));
  std::thread recording([&] { static_cast<void>(client("record ended --unlocked")); });
  ASSERT_TRUE(answers("status", "recording  ended"));
  ASSERT_TRUE(every_camera_has_frames("ended"));
  EXPECT_EQ(daemon.end(SIGTERM), 0);
  recording.join();
  const auto check = session::verify_session(sessions() / "ended");
  ASSERT_TRUE(check.ok()) << check.error().message();
  EXPECT_EQ(check->state, v1::Manifest::COMPLETE);
  EXPECT_TRUE(check->whole()) << check->to_do;
}

TEST_F(DaemonProgram, FromColdToALockedRecordingByTheCommandLine) {
  Program daemon(config());
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
#ifdef EMBERLOCK_SANITIZED
  const std::string seconds = "15";
#else
  const std::string seconds = "2";
#endif
  const Shell run =
      shell("timeout --preserve-status -s TERM " + seconds + " " EMBERLOCKD_PROGRAM " --config " + config());
  EXPECT_EQ(run.status, 0);
  std::istringstream lines(run.output);
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
