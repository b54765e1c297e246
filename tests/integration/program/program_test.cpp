// SPDX-License-Identifier: Apache-2.0
// bin/emberlock as it is started: what it does by itself, and how it hands on.
#include <algorithm>
#include <filesystem>
#include <fstream>
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

/// `emberlock evaluate paper` in a copy of the installed programs, of which emberlock-paper is none.
class EvaluatePaper : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(temp_ / "bin");
    fs::create_directories(temp_ / "libexec/emberlock");
    fs::create_directories(temp_ / "elsewhere");
    fs::copy_file(kProgram, temp_ / "bin/emberlock");
    const std::string verbs = "libexec/emberlock/emberlock";
    fs::copy_file(fs::path(kProgram).parent_path().parent_path() / verbs, temp_ / verbs);
  }
  void write_program(const fs::path& folder) const {
    const fs::path program = temp_ / folder / "emberlock-paper";
    std::ofstream(program) << "#!/bin/sh\necho " << folder.string() << " \"$@\"\nexit 7\n";
    fs::permissions(program, fs::perms::owner_all);
  }
  [[nodiscard]] Shell evaluate(const std::string& options) const {
    return shell("PATH=" + (temp_ / "elsewhere").string() + ":/bin:/usr/bin " +
                 (temp_ / "bin/emberlock").string() + " evaluate paper " + options);
  }
  const test::TempFolder temp_{test::TempFolder::On::disk};
};

TEST_F(EvaluatePaper, SaysHowToBuildTheProgramThatIsMissing) {
  const Shell missing = evaluate("--out demo");
  EXPECT_EQ(missing.status, 1);
  EXPECT_EQ(missing.output,
            "emberlock: emberlock-paper: this program isn't installed. Build it with `scripts/build release "
            "emberlock-paper`, then put it on PATH or next to emberlock\n");
}

TEST_F(EvaluatePaper, HandsOptionsOverAndReturnsTheExitCode) {
  for (const char* folder :
       {"elsewhere", "bin", "libexec/emberlock"}) {  // each has precedence over the one before
    write_program(folder);
    const Shell done = evaluate("--quick --out demo --only a,b -x 'two  words' --help");
    EXPECT_EQ(done.status, 7);
    EXPECT_EQ(done.output, std::string(folder) + " --quick --out demo --only a,b -x two  words --help\n");
  }
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
