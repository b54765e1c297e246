// SPDX-License-Identifier: Apache-2.0
#include "base/nesting.h"

#include <gmock/gmock.h>

namespace emberlock {
namespace {

using testing::HasSubstr;

std::string nested(int depth, char open = '[', char close = ']') {
  return std::string(static_cast<std::size_t>(depth), open) +
         std::string(static_cast<std::size_t>(depth), close);
}

TEST(Nesting, OfJsonIsRefusedOneBeyondWhatIsAllowed) {
  EXPECT_TRUE(check_json_nesting(nested(kDeepestNesting), "a.json").ok());
  EXPECT_TRUE(check_json_nesting(nested(kDeepestNesting, '{', '}'), "a.json").ok());
  const Status deep = check_json_nesting("\n" + nested(kDeepestNesting + 1), "a.json");
  ASSERT_FALSE(deep.ok());
  EXPECT_EQ(deep.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(deep.error().where, "a.json");
  EXPECT_THAT(deep.error().what, HasSubstr("line 2"));
  EXPECT_FALSE(check_json_nesting(std::string(1'000'000, '{'), "a.json").ok()) << "never closed";
}

TEST(Nesting, BracketsInStringsDoNotCountNorCanTheyHideOthers) {
  EXPECT_TRUE(check_json_nesting("{\"a\": \"" + std::string(1000, '[') + "\"}", "a").ok());
  EXPECT_TRUE(check_json_nesting(R"(["\"[[[", "\\", ")" + std::string(1000, '[') + "\"]", "a").ok());
  std::string text;
  for (int i = 0; i < 200; ++i) text += "[\"]\", ";
  EXPECT_FALSE(check_json_nesting(text, "a").ok());
}

TEST(Nesting, SiblingsAreNotDeep) {
  std::string text = "[";
  for (int i = 0; i < 100'000; ++i) text += "[1],{},";
  EXPECT_TRUE(check_json_nesting(text + "0]", "a").ok());
}

TEST(Nesting, ACommaBeforeAClosingBracketIsPlaced) {
  for (const char* text : {"[1,\n2,\n]", "{\"a\": 1,\n\"b\": \"]\" ,\n\n}", "[[],\n{},]"})
    EXPECT_THAT(check_json_nesting(text, "a.json").error().message(),
                HasSubstr("a comma stands before the closing"))
        << text;
  EXPECT_THAT(check_json_nesting("[1,\n2,\n]", "a.json").error().what, HasSubstr("line 2"));
  for (const char* text : {"[1, 2]", R"([",", "],", "\\",[",]"]])", R"({"a,": "}"})", "", "[\n]"})
    EXPECT_TRUE(check_json_nesting(text, "a.json").ok()) << text;
}

TEST(Nesting, Utf16IsNamed) {
  using namespace std::string_view_literals;
  for (const std::string_view text : {"\xff\xfe{\0}\0"sv, "\xfe\xff\0{\0}"sv, "{\0}\0"sv, "\0{\0}"sv})
    EXPECT_THAT(check_json_nesting(text, "a.json").error().message(), HasSubstr("UTF-16"));
  EXPECT_TRUE(check_json_nesting("\xef\xbb\xbf{}", "a.json").ok()) << "a mark of UTF-8";
}

TEST(Nesting, AnEndThatIsMissingIsSeen) {
  const std::string whole = R"({"a": [1, "}]", {"b": "\\\""}], "c": 2})";
  EXPECT_FALSE(ends_too_early(whole));
  for (std::size_t n = 0; n < whole.size(); ++n) EXPECT_TRUE(ends_too_early(whole.substr(0, n))) << n;
  EXPECT_FALSE(ends_too_early("{\"a\": 1 \"b\": 2}")) << "malformed, but whole";
}

TEST(Nesting, NumbersThatAreNoneBecomeNullOutsideOfStrings) {
  EXPECT_EQ(with_null_for_nan(R"([NaN, -Infinity,Infinity, nan, -inf, "NaN", {"inf": inf}])"),
            R"([null, null,null, null, null, "NaN", {"inf": null}])");
  EXPECT_EQ(with_null_for_nan("[1, Name, Nano, xNaN, true]"), "[1, Name, Nano, xNaN, true]");
}

}  // namespace
}  // namespace emberlock
