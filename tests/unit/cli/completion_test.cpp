// SPDX-License-Identifier: Apache-2.0
// What shells offer, asked of the shells themselves.
#include "cli/completion.h"

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "cli/commands.h"
#include "cli/manual.h"
#include "tests/support/recording.h"
#include "tests/support/shell.h"

namespace emberlock::cli {
namespace {
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

class Completion : public ::testing::Test {
 protected:
  Completion() {
    program_.add_version_flag("1");
    add_devices(program_);
    add_align(program_);
    add_manual(program_, "1");
    std::ofstream(folder_ / "bash") << bash_completion(program_);
    std::ofstream(folder_ / "zsh") << zsh_completion(program_);
    std::ofstream(folder_ / "fish") << fish_completion(program_);
    std::ofstream(folder_ / "a_file");
  }

  /// What a shell offers at the end of a line, a word a line; without what it says of it behind ':' or a tab.
  static std::vector<std::string> words_of(const std::string& output) {
    std::vector<std::string> words;
    std::istringstream lines(output);
    for (std::string line; std::getline(lines, line);)
      if (!line.empty()) words.push_back(line.substr(0, line.find_first_of(":\t")));
    return words;
  }
  [[nodiscard]] std::vector<std::string> in_shell(const std::string& name, const std::string& command,
                                                  const std::string& line) const {
    return words_of(shell("cd '" + folder_.path().string() + "' && HOME=$PWD " + name + " '" + command +
                          "' '" + line + "'")
                        .output);
  }
  [[nodiscard]] std::vector<std::string> bash_offers(const std::string& line) const {
    return in_shell("bash -c",
                    "set -eu; source ./bash; COMP_WORDS=($0); [ \"${0% }\" = \"$0\" ] || COMP_WORDS+=(\"\"); "
                    "COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _emberlock; printf \"%s\\n\" \"${COMPREPLY[@]}\"",
                    line);
  }
  /// Whatever was typed of the last word: zsh chooses among them by itself.
  [[nodiscard]] std::vector<std::string> zsh_offers(const std::string& line) const {
    return in_shell("zsh -f -c",
                    "_describe() { print -l -- ${(P)2} }; _files() { print FILES }; words=(${=0}); "
                    "[ \"${0% }\" = \"$0\" ] || words+=(\"\"); CURRENT=$#words; source ./zsh",
                    line);
  }
  [[nodiscard]] std::vector<std::string> fish_offers(const std::string& line) const {
    return in_shell("fish --no-config -c", "source ./fish; complete -C $argv[1]", line);
  }

  test::TempFolder folder_;
  CommandLine line_{"What it is."};
  Verb program_ = line_.program();
};

TEST_F(Completion, BashOffersVerbsTheirVerbsAndTheirOptions) {
  EXPECT_THAT(bash_offers("emberlock "),
              ElementsAre("devices", "align", "completion", "--help", "--version"));
  EXPECT_THAT(bash_offers("emberlock al"), ElementsAre("align"));
  EXPECT_THAT(bash_offers("emberlock devices "),
              ElementsAre("probe", "clips", "watch", "--help", "--modes", "--json"));
  EXPECT_THAT(bash_offers("emberlock devices probe --res"), ElementsAre("--resets"));
  EXPECT_THAT(bash_offers("emberlock align --json --max-r"), ElementsAre("--max-rounds", "--max-resets"));
}

TEST_F(Completion, BashOffersFilesBehindAnOptionThatTakesAValue) {
  EXPECT_THAT(bash_offers("emberlock align --delays "), IsEmpty());  // bash's own completion of files follows
}

TEST_F(Completion, ZshOffersVerbsTheirVerbsAndTheirOptions) {
  EXPECT_THAT(zsh_offers("emberlock "), ElementsAre("devices", "align", "completion", "--help", "--version"));
  EXPECT_THAT(zsh_offers("emberlock devices "),
              ElementsAre("probe", "clips", "watch", "--help", "--modes", "--json"));
  EXPECT_THAT(zsh_offers("emberlock devices probe "), Contains("--resets"));
  EXPECT_THAT(zsh_offers("emberlock align --json "), Contains("--max-rounds"));
}

TEST_F(Completion, ZshOffersFilesBehindAnOptionThatTakesAValue) {
  EXPECT_THAT(zsh_offers("emberlock align --delays "), ElementsAre("FILES"));
}

TEST_F(Completion, FishOffersVerbsTheirVerbsAndTheirOptions) {
  EXPECT_THAT(fish_offers("emberlock al"), ElementsAre("align"));
  EXPECT_THAT(fish_offers("emberlock devices pr"), ElementsAre("probe"));
  EXPECT_THAT(fish_offers("emberlock devices --"), UnorderedElementsAre("--help", "--modes", "--json"));
  EXPECT_THAT(fish_offers("emberlock devices probe --res"), ElementsAre("--resets"));
  EXPECT_THAT(fish_offers("emberlock align --json --max-r"),
              UnorderedElementsAre("--max-rounds", "--max-resets"));
}

TEST_F(Completion, FishOffersFilesBehindAnOptionThatTakesAValue) {
  EXPECT_THAT(fish_offers("emberlock align --delays a_"), ElementsAre("a_file"));
}

}  // namespace
}  // namespace emberlock::cli
