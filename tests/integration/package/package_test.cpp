// SPDX-License-Identifier: Apache-2.0
// What `cmake --install` lays down, and the Debian package that cpack made of it (the test `package` before
// this one).
#include <algorithm>
#include <filesystem>
#include <regex>
#include <set>
#include <string>

#include <gmock/gmock.h>

#include "base/file.h"
#include "tests/support/shell.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Installed : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    fs::remove_all(prefix());
    const Shell install =
        shell("cmake --install " EMBERLOCK_BUILD_DIR " --prefix " + prefix().string() + " >/dev/null");
    ASSERT_EQ(install.status, 0) << install.output;
  }
  static void TearDownTestSuite() { fs::remove_all(prefix()); }
  static fs::path prefix() {
    return fs::temp_directory_path() / ("emberlock_installed_" + std::to_string(::getpid()));
  }
  static Shell run(const std::string& command) { return shell("cd " + prefix().string() + " && " + command); }
};

TEST_F(Installed, NothingIsMissing) {
  for (const char* file :
       {"bin/emberlock", "libexec/emberlock/emberlock", "sbin/emberlockd", "etc/emberlock/emberlockd.toml",
        "lib/systemd/system/emberlockd.service", "lib/sysusers.d/emberlock.conf",
        "lib/udev/rules.d/72-emberlock.rules", "share/man/man1/emberlock.1.gz",
        "share/man/man5/emberlockd.toml.5.gz", "share/man/man8/emberlockd.8.gz",
        "share/bash-completion/completions/emberlock", "share/zsh/vendor-completions/_emberlock",
        "share/fish/vendor_completions.d/emberlock.fish"}) {
    EXPECT_TRUE(fs::exists(prefix() / file)) << file;
  }
}

TEST_F(Installed, TheConfigurationIsValidAndTheOperatorsOwnStays) {
  // Its folders are the daemon's, which whoever runs this test may not make: only what the text says counts
  // here.
  const auto config = read_file(prefix() / "etc/emberlock/emberlockd.toml");
  ASSERT_TRUE(config.ok());
  EXPECT_EQ(run("sbin/emberlockd --print-config | cmp - etc/emberlock/emberlockd.toml").status, 0);
  ASSERT_EQ(run("echo '# mine' >>etc/emberlock/emberlockd.toml && cmake --install " EMBERLOCK_BUILD_DIR
                " --prefix $PWD >/dev/null && grep -q '# mine' etc/emberlock/emberlockd.toml")
                .status,
            0);
}

TEST_F(Installed, SystemdFindsNoFaultWithTheUnitAndLittleExposed) {
  const Shell verify = run("systemd-analyze verify --man=no lib/systemd/system/emberlockd.service");
  EXPECT_EQ(verify.status, 0) << verify.output;
  const Shell security =
      run("systemd-analyze security --offline=true --threshold=20 lib/systemd/system/emberlockd.service | "
          "tail -1");
  EXPECT_THAT(security.output, HasSubstr("Overall exposure level"));
  std::smatch level;
  ASSERT_TRUE(std::regex_search(security.output, level, std::regex(": ([0-9.]+)")));
  EXPECT_LE(std::stod(level[1]), 2.0) << security.output;
}

TEST_F(Installed, TheDaemonsPageHoldsEveryOptionOfItsHelp) {
  const std::string help = run("sbin/emberlockd --help").output;
  const std::string page = run("zcat share/man/man8/emberlockd.8.gz | tr -d '\\\\'").output;
  const std::regex option("--[a-z][a-z-]*");
  std::set<std::string> said;
  for (auto it = std::sregex_iterator(help.begin(), help.end(), option); it != std::sregex_iterator(); ++it)
    said.insert(it->str());
  EXPECT_GE(said.size(), 4u) << help;
  for (const std::string& each : said) EXPECT_THAT(page, HasSubstr(each));
}

TEST_F(Installed, BashCompletesTheProgramsVerbs) {
  const Shell offered =
      run("bash -c 'source share/bash-completion/completions/emberlock; COMP_WORDS=(emberlock al); "
          "COMP_CWORD=1; _emberlock; "
          "echo \"${COMPREPLY[@]}\"'");
  EXPECT_EQ(offered.output, "align\n");
}

TEST(Package, HoldsTheProgramsAndNothingForDevelopers) {
  const Shell listed = shell("dpkg --contents " EMBERLOCK_BUILD_DIR "/emberlock_*.deb");
  EXPECT_THAT(listed.output, HasSubstr("./usr/bin/emberlock\n"));
  EXPECT_THAT(listed.output, HasSubstr("./usr/libexec/emberlock/emberlock\n"));
  for (const char* path : {"/usr/include", "/cmake/", ".a\n"})
    EXPECT_THAT(listed.output, ::testing::Not(HasSubstr(path)));
}

TEST(Package, LintianFindsNoError) {
  const Shell lintian = shell("lintian --allow-root --fail-on error " EMBERLOCK_BUILD_DIR "/emberlock_*.deb");
  EXPECT_EQ(lintian.status, 0) << lintian.output;
}

}  // namespace
}  // namespace emberlock
