// SPDX-License-Identifier: Apache-2.0
#include "rig/config/preflight.h"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>

#include "tests/support/temp_folder.h"

namespace emberlock::rig {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class Preflight : public ::testing::Test {
 protected:
  fs::path write(const std::string& name, const std::string& text, unsigned mode = 0600) const {
    std::ofstream(folder_ / name) << text;
    fs::permissions(folder_ / name, static_cast<fs::perms>(mode));
    return folder_ / name;
  }
  /// Of a file that says this, after folders that exist.
  std::vector<Error> problems(const std::string& text) const {
    return check_config(write("lab.toml", text + "\n[recording]\nfolder = \"sessions\"\n"));
  }

  const test::TempFolder folder_;
};

constexpr const char* kServer = "[server]\nsocket = \"here.sock\"\n";

TEST_F(Preflight, AFileWhoseFoldersCanBeMadeIsFine) { EXPECT_THAT(problems(kServer), IsEmpty()); }

TEST_F(Preflight, AFileThatIsNotThereIsNamed) {
  const auto found = check_config(folder_ / "absent.toml");
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found.front().message(), HasSubstr("absent.toml"));
}

TEST_F(Preflight, ProblemsOfTheTextComeFirst) {
  const auto found = problems("[log]\nlevel = 3\nfolder = 4");
  ASSERT_THAT(found, SizeIs(2));
  EXPECT_THAT(found.front().where, HasSubstr("lab.toml:2:9"));
}

TEST_F(Preflight, ATokenThatEverybodyReadsIsRefused) {
  write("token", "0123456789abcdef0123\n", 0644);
  const auto found = problems(kServer + std::string("token_file = \"token\""));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found.front().message(),
              HasSubstr("everybody may read or write the token (mode 0644). Make it private: chmod o= "));
  write("token", "0123456789abcdef0123\n", 0640);
  EXPECT_THAT(problems(kServer + std::string("token_file = \"token\"")), IsEmpty());
  write("token", "0123456789abcdef0123\n", 0660);
  EXPECT_THAT(problems(kServer + std::string("token_file = \"token\"")), SizeIs(1));
  write("token", "short\n", 0600);
  EXPECT_THAT(problems(kServer + std::string("token_file = \"token\"")), SizeIs(1));
}

TEST_F(Preflight, FilesThatAreNotThereAndFoldersThatAreFilesAreNamed) {
  write("sessions", "not a folder");
  const auto found = problems(kServer + std::string("tls_certificate = \"a.crt\"\ntls_key = \"a.key\"\n"
                                                    "[rig]\ncalibration = \"absent.json\"\n"
                                                    "[rig.replay]\nsession = \"absent\"\n"
                                                    "[reconstruction]\nprogram = \"./absent\"\n"));
  std::string all;
  for (const Error& problem : found) all += problem.message() + "\n";
  EXPECT_THAT(found, SizeIs(6)) << all;
  for (const char* part : {"recording.folder", "server.tls_certificate", "server.tls_key", "absent.json",
                           "reconstruction.program"}) {
    EXPECT_THAT(all, HasSubstr(part));
  }
}

}  // namespace
}  // namespace emberlock::rig
