// SPDX-License-Identifier: Apache-2.0
// bin/emberlock as it is started: what it does by itself, and how it hands on.
#include <algorithm>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>

#include "tests/support/recording.h"
#include "tests/support/shell.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

const std::string kProgram = EMBERLOCK_PROGRAM;

TEST(Program, SaysItsVersion) {
  EXPECT_THAT(shell(kProgram + " --version").output,
              testing::MatchesRegex("emberlock [0-9]+\\.[0-9]+\\.[0-9]+(\\+[0-9]+\\.g[0-9a-f]+)?\n"));
}

/// What makes it start fast: `perf stat -r 20 build/release/bin/emberlock --version`.
TEST(Program, LoadsNoLibraryOfPicturesFilmsOrVolumes) {
  const std::string loaded = shell("ldd " + kProgram).output;
  EXPECT_THAT(loaded, HasSubstr("libstdc++"));
  for (const char* library : {"opencv", "libav", "openvdb", "gdal", "ceres", "aravis", "usb"})
    EXPECT_THAT(loaded, Not(HasSubstr(library)));
  EXPECT_LT(std::ranges::count(loaded, '\n'), 90);
}

TEST(Program, HandsOnVerbsAndTheirExitCodes) {
  const Shell help = shell(kProgram + " --help");
  EXPECT_EQ(help.status, 0);
  EXPECT_THAT(help.output, HasSubstr("reconstruct"));
  EXPECT_EQ(shell(kProgram + " nonsense").status, 2);
  EXPECT_EQ(shell(kProgram).status, 2);
  EXPECT_EQ(shell(kProgram + " reconstruct /nowhere --out /nowhere/else").status, 2);
}

TEST(Program, SaysWhatIsMissingWhereOnlyHalfOfItIsInstalled) {
  const test::TempFolder temp(test::TempFolder::On::disk);
  fs::create_directory(temp / "bin");
  fs::copy_file(kProgram, temp / "bin/emberlock");
  const std::string half = (temp / "bin/emberlock").string();
  EXPECT_EQ(shell(half + " --version").status, 0);
  const Shell verb = shell(half + " reconstruct");
  EXPECT_EQ(verb.status, 1);
  EXPECT_THAT(verb.output, HasSubstr((temp / "libexec/emberlock/emberlock").string()));
#if EMBERLOCK_WITH_DAEMON
  EXPECT_EQ(shell(half + " status --daemon unix:/nowhere").status, 3);
#endif
}

class Version : public ::testing::Test {
 protected:
  void SetUp() override { git("init -q"); }
  void git(const std::string& words) const {
    const Shell did = shell("git -C " + temp_.path().string() + " -c user.name=a -c user.email=a@b " + words);
    ASSERT_EQ(did.status, 0) << did.output;
  }
  void commit() const { git("commit -q --allow-empty -m x"); }
  [[nodiscard]] std::string said() const {
    return shell("cmake -D FOLDER=" + temp_.path().string() +
                 " -P " EMBERLOCK_SOURCE_DIR "/base/version.cmake")
        .output;
  }
  test::TempFolder temp_;
};

TEST_F(Version, IsTheTagAndTheCommitsSince) {
  commit();
  git("tag v2.3.4");
  EXPECT_EQ(said(), "2.3.4\n");
  commit();
  EXPECT_THAT(said(), testing::MatchesRegex("2\\.3\\.4\\+1\\.g[0-9a-f]+\n"));
  git("tag nightly");
  EXPECT_THAT(said(), testing::MatchesRegex("2\\.3\\.4\\+1\\.g[0-9a-f]+\n"));
}

TEST_F(Version, WithoutATagIsTheLastReleaseOfTheChangeLogAndTheCommit) {
  EXPECT_THAT(said(), testing::EndsWith("+unknown\n")) << "nothing is committed";
  commit();
  const std::string version = said();
  EXPECT_THAT(version, testing::ContainsRegex("\\+0\\.g[0-9a-f]+\n$"));
  const std::string changes = test::bytes_of(EMBERLOCK_SOURCE_DIR "/CHANGELOG.md");
  EXPECT_THAT(changes, HasSubstr("\n## " + version.substr(0, version.find('+')) + "\n"));
}

}  // namespace
}  // namespace emberlock
