// SPDX-License-Identifier: Apache-2.0
#include "cli/manual.h"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>

#include "base/roff.h"
#include "cli/commands.h"
#include "rig/config/manual.h"
#include "tests/support/recording.h"
#include "tests/support/shell.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

class Manual : public ::testing::Test {
 protected:
  Manual() {
    program_.add_version_flag("1");
    add_devices(program_);
    add_align(program_);
    add_manual(program_, "1");
  }
  CommandLine line_{"What it is."};
  Verb program_ = line_.program();
};

TEST_F(Manual, ThePageHoldsEveryVerbAndOptionThatHelpShows) {
  const std::string page = manual_page(program_, "1");
  for (const char* part :
       {"emberlock devices probe", "\\-\\-reset\\-seconds", "\\-\\-control", "What it is."})
    EXPECT_THAT(page, HasSubstr(part));
  EXPECT_THAT(page, HasSubstr("emberlock completion"));
  EXPECT_THAT(page, Not(HasSubstr("emberlock man\"")));
}

TEST_F(Manual, PagesAreGoodRoff) {
  const test::TempFolder folder;
  const fs::path page = folder / "page.roff";
  for (const std::string& text : {manual_page(program_, "1"), rig::config_manual("1")}) {
    std::ofstream(page) << text;
    EXPECT_EQ(shell("LC_ALL=C.UTF-8 groff -man -Tutf8 -ww -z '" + page.string() + "' 2>&1").output, "");
    const std::string shown =
        shell("LC_ALL=C.UTF-8 groff -man -Tascii -P-cbou -rLL=200n '" + page.string() + "'").output;
    EXPECT_THAT(shown, HasSubstr("NAME"));
    EXPECT_THAT(shown, Not(HasSubstr("\\")));
  }
}

TEST(ConfigManual, EveryKeyIsThere) {
  const std::string page = rig::config_manual("1");
  for (const char* part :
       {"[rig.strobe]", "[[rig.camera]]", "flash_width_us", "A number from 0.1 to 10000", "\"10rows\""})
    EXPECT_THAT(page, HasSubstr(roff(part)));
}

}  // namespace
}  // namespace emberlock::cli
