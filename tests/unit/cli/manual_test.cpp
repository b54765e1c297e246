#include "cli/manual.h"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>

#include "cli/commands.h"
#include "daemon/config/manual.h"
#include "tests/support/shell.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Manual : public ::testing::Test {
 protected:
  Manual() {
    app_.set_version_flag("--version", "1");
    add_devices(app_);
    add_align(app_);
    add_manual(app_, "1");
    std::ofstream(script_) << bash_completion(app_);
  }
  ~Manual() override { fs::remove(script_); }

  /// What bash offers at the end of a line.
  std::vector<std::string> offered(const std::string& line) const {
    std::istringstream out(
        shell("bash -c 'set -eu; source \"$0\"; COMP_WORDS=($1); [ \"${1% }\" = \"$1\" ] || "
              "COMP_WORDS+=(\"\"); "
              "COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _emberlock; printf \"%s\\n\" \"${COMPREPLY[@]}\"' '" +
              script_.string() + "' '" + line + "'")
            .output);
    std::vector<std::string> words;
    for (std::string word; out >> word;) words.push_back(word);
    return words;
  }

  CLI::App app_{"What it is.", "emberlock"};
  fs::path script_ = fs::temp_directory_path() / ("emberlock_completion_" + std::to_string(::getpid()));
};

TEST_F(Manual, BashCompletesVerbsTheirVerbsAndTheirOptions) {
  EXPECT_THAT(offered("emberlock "), ElementsAre("devices", "align", "--help", "--version"));
  EXPECT_THAT(offered("emberlock al"), ElementsAre("align"));
  EXPECT_THAT(offered("emberlock devices "), ElementsAre("probe", "watch", "--help", "--modes", "--json"));
  EXPECT_THAT(offered("emberlock devices probe --res"), ElementsAre("--resets"));
  EXPECT_THAT(offered("emberlock align --json --max-r"), ElementsAre("--max-rounds", "--max-resets"));
}

TEST_F(Manual, BashOffersFilesBehindAnOptionThatTakesAValue) {
  EXPECT_THAT(offered("emberlock align --delays "), IsEmpty());  // bash's own completion of files follows
}

TEST_F(Manual, ThePageHoldsEveryVerbAndOptionThatHelpShows) {
  const std::string page = manual_page(app_, "1");
  for (const char* part :
       {"emberlock devices probe", "\\-\\-reset\\-seconds", "\\-\\-control", "What it is."})
    EXPECT_THAT(page, HasSubstr(part));
  EXPECT_THAT(page, Not(HasSubstr("completion")));
}

TEST_F(Manual, PagesAreGoodRoff) {
  const fs::path page = script_.string() + ".roff";
  for (const std::string& text : {manual_page(app_, "1"), config_manual("1")}) {
    std::ofstream(page) << text;
    EXPECT_EQ(shell("LC_ALL=C.UTF-8 groff -man -Tutf8 -ww -z '" + page.string() + "' 2>&1").output, "");
    const std::string shown =
        shell("LC_ALL=C.UTF-8 groff -man -Tascii -P-cbou -rLL=200n '" + page.string() + "'").output;
    EXPECT_THAT(shown, HasSubstr("NAME"));
    EXPECT_THAT(shown, Not(HasSubstr("\\")));
  }
  fs::remove(page);
}

TEST(ConfigManual, EveryKeyIsThere) {
  const std::string page = config_manual("1");
  for (const char* part :
       {"[rig.strobe]", "[[rig.camera]]", "flash_width_us", "A number from 0.1 to 10000", "\"100rows\""})
    EXPECT_THAT(page, HasSubstr(roff(part)));
}

}  // namespace
}  // namespace emberlock::cli
