// SPDX-License-Identifier: Apache-2.0
#include "cli/numbers.h"

#include <iterator>
#include <sstream>

#include <gmock/gmock.h>

#include "cli/app_tree.h"
#include "cli/commands.h"

namespace emberlock::cli {
namespace {

using ::testing::HasSubstr;

TEST(Numbers, StandBetweenCommasAndBlanksDontCount) {
  using Three = std::array<double, 3>;
  EXPECT_EQ(parse_numbers_of<3>("1,2,3"), (Three{1, 2, 3}));
  EXPECT_EQ(parse_numbers_of<3>(" 0, -0.5 ,1e3 "), (Three{0, -0.5, 1000}));
  for (const char* bad :
       {"", "1,2", "1,2,3,4", "1,2,3,", ",1,2", "1,,3", "1 2 3", "1,2,x", "1,2,inf", "1,2,nan", "1e300,2,3"})
    EXPECT_FALSE(parse_numbers_of<3>(bad).has_value()) << bad;
}

/// Every option of every verb whose value is a number with a fraction, and what no number is. No message
/// prints a limit with hundreds of digits.
TEST(NumberOptions, TakeFiniteNumbersOnly) {
  const CommandLine line;
  const Verb program = line.program();
  for (const auto add :
       {add_devices, add_smear,         add_align,    add_import,   add_calibrate, add_reconstruct,
        add_batch,   add_verify_volume, add_view,     add_render,   add_scene,     add_stylize,
        add_ar,      add_marker,        add_export,   add_measure,  add_verify,    add_tradeoff,
        add_demo,    add_sample,        add_simulate, add_sessions, add_doctor,    add_bench,
        add_design})
    add(program);
  int options = 0;
  const VerbWords tree = describe_tree(program);
  for (const VerbWords* verb : list_verbs(tree))
    for (const OptionWords& option : verb->options) {
      if (option.type.find("FLOAT") == std::string::npos || option.long_names.empty()) continue;
      ++options;
      for (const char* text : {"nan", "NaN", "-nan", "inf", "-inf", "infinity", "1e999", "-1e999"}) {
        std::istringstream path(verb->path);
        std::vector<std::string> words{std::istream_iterator<std::string>(path), {}};
        words.erase(words.begin());  // the program's name
        words.push_back("--" + option.long_names.front() + "=" + text);
        try {
          line.parse(words);
          ADD_FAILURE() << verb->path << " " << words.back() << " is taken";
        } catch (const UsageError& error) {
          EXPECT_THAT(error.what(), HasSubstr("is not a finite number")) << verb->path << " " << words.back();
        }
      }
    }
  EXPECT_GE(options, 20);
}

TEST(NumberOptions, RefuseWhatIsOutOfRangeInAShortSentence) {
  const CommandLine line;
  const Verb verb = line.program().add_verb("verb", "");
  double ranged = 1, positive = 1, not_negative = 1, tiny = 1;
  int whole = 1;
  std::vector<double> list;
  verb.add_option("--ranged", ranged, "").check_range(1e-6, 1e6);
  verb.add_option("--positive", positive, "").check_positive();
  verb.add_option("--not-negative", not_negative, "").check_not_negative();
  verb.add_option("--tiny", tiny, "").check_unshown_range(-1e300, 1e300);
  verb.add_option("--whole", whole, "").check_range(1, 64);
  verb.add_option("--list", list, "").split_at_commas().check_range(0.0, 1.0);
  struct Row {
    const char* word;
    const char* says;  ///< empty: it is taken
  };
  for (const Row& row : {Row{"--ranged=1e-6", ""},
                         {"--ranged=1e6", ""},
                         {"--ranged=0", "0 is not a number from 1e-06 to 1e+06"},
                         {"--ranged=24.2Hz", "24.2Hz is not a number from 1e-06 to 1e+06"},
                         {"--positive=1e-300", ""},
                         {"--positive=1e308", ""},
                         {"--positive=0", "0 is not a number above 0"},
                         {"--positive=-1", "-1 is not a number above 0"},
                         {"--positive=nan", "finite"},
                         {"--not-negative=0", ""},
                         {"--not-negative=-1e-300", "is not a number from 0 on"},
                         {"--not-negative=-0", ""},
                         {"--tiny=2e300", "is not a number from -1e+300 to 1e+300"},
                         {"--tiny=-1e300", ""},
                         {"--whole=64", ""},
                         {"--whole=65", "65 is not a whole number from 1 to 64"},
                         {"--whole=nan", "nan is not a whole number from 1 to 64"},
                         {"--whole=1.5", "1.5 is not a whole number from 1 to 64"},
                         {"--list=0,0.5,1", ""},
                         {"--list=0,nan", "finite"},
                         {"--list=0,2", "2 is not a number from 0 to 1"}}) {
    std::string said;
    try {
      line.parse({"verb", row.word});
    } catch (const UsageError& error) {
      said = error.what();
    }
    EXPECT_EQ(said.empty(), *row.says == 0) << row.word << ": " << said;
    EXPECT_THAT(said, HasSubstr(row.says));
    EXPECT_LE(said.size(), 90U) << said;
  }
}

}  // namespace
}  // namespace emberlock::cli
