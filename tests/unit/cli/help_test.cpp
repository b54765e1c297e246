// SPDX-License-Identifier: Apache-2.0
#include "cli/help.h"

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "cli/commands.h"

namespace emberlock::cli {
namespace {
using ::testing::HasSubstr;
using ::testing::Not;

class Help : public ::testing::Test {
 protected:
  Help() {
    program_.require_verb();
    style_help(program_);
    add_devices(program_);
    add_align(program_);
    add_calibrate(program_);
    add_reconstruct(program_);
    add_doctor(program_);
    add_help(program_);
  }
  struct Said {
    int code = 0;
    std::string out, err;
  };
  /// As main() does.
  Said run_words(const std::vector<std::string>& words) {
    std::vector<std::string> all{"emberlock"};
    all.insert(all.end(), words.begin(), words.end());
    std::vector<char*> argv;
    for (std::string& word : all) argv.push_back(word.data());
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    Said said;
    said.code = run(line_, static_cast<int>(argv.size()), argv.data());
    said.out = testing::internal::GetCapturedStdout();
    said.err = testing::internal::GetCapturedStderr();
    return said;
  }
  CommandLine line_{"What it is."};
  Verb program_ = line_.program();
};

TEST_F(Help, WithoutAVerbItSaysWhichThereAreInGroups) {
  const Said said = run_words({});
  EXPECT_EQ(said.code, 2);
  EXPECT_EQ(said.err, "");
  for (const char* part : {"What it is.", "First steps:\n  doctor ", "Cameras:\n  devices ",
                           "\nVolumes:\n  recon", "`emberlock help VERB`", "virtual:11"})
    EXPECT_THAT(said.out, HasSubstr(part));
  EXPECT_EQ(run_words({"help"}).out, said.out);
  EXPECT_EQ(run_words({"--help"}).out, said.out);
}

TEST_F(Help, EveryLineFitsATerminal) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"help"}, {"help", "align"}, {"help", "calibrate", "colour"}}) {
    std::istringstream lines(run_words(words).out);
    for (std::string line; std::getline(lines, line);) {
      const bool fits = line.size() <= 100 || !line.starts_with("   ");
      EXPECT_TRUE(fits) << line;
    }
  }
}

TEST_F(Help, OfAVerbNamesItsOptionsAndOfAGroupItsVerbs) {
  const Said align = run_words({"help", "align"});
  EXPECT_EQ(align.code, 0);
  EXPECT_THAT(align.out, HasSubstr("Usage: emberlock align"));
  EXPECT_THAT(align.out, HasSubstr("--tolerance"));
  const Said calibrate = run_words({"help", "calibrate"});
  EXPECT_THAT(calibrate.out, HasSubstr("cameras"));
  EXPECT_THAT(run_words({"help", "calibrate", "cameras"}).out,
              HasSubstr("Usage: emberlock calibrate cameras"));
  EXPECT_EQ(run_words({"calibrate"}).out, calibrate.out);
  const Said none = run_words({"help", "alig"});
  EXPECT_EQ(none.code, 2);
  EXPECT_THAT(none.err, HasSubstr("Did you mean align?"));
}

TEST_F(Help, AVerbOrAnOptionThatIsNoneNamesTheOneThatWasMeant) {
  const Said verb = run_words({"allign", "--rig", "virtual:3"});
  EXPECT_EQ(verb.code, 2);
  EXPECT_THAT(verb.err, HasSubstr("there is no verb \"allign\". Did you mean align?"));
  EXPECT_EQ(verb.out, "");
  EXPECT_THAT(run_words({"calibrate", "camera"}).err,
              HasSubstr("no verb \"camera\" of `emberlock calibrate`. Did you mean cameras?"));
  const Said option = run_words({"align", "--toleranse=10rows"});
  EXPECT_EQ(option.code, 2);
  EXPECT_THAT(option.err,
              HasSubstr("no option \"--toleranse\" of `emberlock align`. Did you mean --tolerance?"));
  EXPECT_THAT(run_words({"frobnicate"}).err, HasSubstr("`emberlock help` lists them"));
  EXPECT_THAT(run_words({"align", "--frobnicate"}).err, HasSubstr("`emberlock help align` lists them"));
  EXPECT_THAT(run_words({"align", "--seed", "many"}).err, HasSubstr("`emberlock help align` says how"));
}

}  // namespace
}  // namespace emberlock::cli
