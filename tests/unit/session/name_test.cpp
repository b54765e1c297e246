// SPDX-License-Identifier: Apache-2.0
#include "session/name.h"

#include <string>

#include <gtest/gtest.h>

namespace emberlock::session {
namespace {

TEST(SessionName, WhatPeopleCallARecordingIsTaken) {
  for (const char* name : {"flame", "2026-11-22 03-15-09", "run_7.b", "00:11:22", "console", "a"}) {
    EXPECT_TRUE(check_session_name(name)) << name;
  }
  EXPECT_TRUE(check_session_name(std::string(200, 'x')));
}

TEST(SessionName, WhatLeadsElsewhereOrBreaksATerminalIsRefused) {
  for (const std::string& name :
       {std::string(), std::string("."), std::string(".."), std::string("../x"), std::string("/etc/passwd"),
        std::string("a/b"), std::string("a\\b"), std::string(".hidden"), std::string("a\0b", 3),
        std::string("a\nb"), std::string("a\x1b[2J"), std::string("fl\xc3\xa4mme"), std::string("\xff"),
        std::string("*"), std::string("a|b"), std::string(201, 'x'), std::string(256, 'x')}) {
    const Status status = check_session_name(name);
    ASSERT_FALSE(status) << name;
    EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
    for (const char c : status.error().message()) EXPECT_TRUE(c >= ' ' && c <= '~');
    EXPECT_LT(status.error().message().size(), 250U);
  }
}

TEST(SessionName, WhatLooksLikeAnOptionOrLikeNothingIsRefusedAndSaysWhy) {
  for (const char* name : {"-", "-rf", "--help", "-1"}) {
    const Status status = check_session_name(name);
    ASSERT_FALSE(status) << name;
    EXPECT_NE(status.error().message().find("hyphen"), std::string::npos);
  }
  for (const char* name : {" ", " lead", "  two"}) {
    const Status status = check_session_name(name);
    ASSERT_FALSE(status) << name;
    EXPECT_NE(status.error().message().find("begins with a space"), std::string::npos);
  }
  EXPECT_TRUE(check_session_name("take-2 - second"));
}

TEST(Text, IsBoundedAndOnOneLine) {
  EXPECT_TRUE(check_text("purpose", ""));
  EXPECT_TRUE(check_text("purpose", "fl\xc3\xa4mme, third try: \"blue\""));
  EXPECT_TRUE(check_text("purpose", std::string(kMaxTextBytes, 'x')));
  for (const std::string& text :
       {std::string(3'900'000, 'x'), std::string(kMaxTextBytes + 1, 'x'), std::string("two\nlines"),
        std::string("a\0b", 3), std::string("\x1b[2J")}) {
    const Status status = check_text("purpose", text);
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
    EXPECT_EQ(status.error().where, "field purpose");
    EXPECT_LT(status.error().message().size(), 250U);
  }
}

TEST(SessionName, WhatWindowsCannotHoldIsRefused) {
  for (const char* name : {"con", "NUL", "Com7", "lpt1.log", "aux .txt", "ends.", "ends "}) {
    EXPECT_FALSE(check_session_name(name)) << name;
  }
}

}  // namespace
}  // namespace emberlock::session
