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

}  // namespace
}  // namespace emberlock
