// SPDX-License-Identifier: Apache-2.0
#include "session/name.h"

#include <string>

#include <gtest/gtest.h>

#include "session/text.h"

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
        std::string("a\nb"), std::string("a\x1b[2J"), std::string("\xff"), std::string("*"),
        std::string("a|b"), std::string(201, 'x'), std::string(256, 'x')}) {
    const Status status = check_session_name(name);
    ASSERT_FALSE(status) << name;
    EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
    for (const char c : status.error().message()) EXPECT_TRUE(c >= ' ' && c <= '~');
    EXPECT_LT(status.error().message().size(), 250U);
  }
}

TEST(SessionName, AnyScriptIsTaken) {
  for (const char* name :
       {"fl\u00e4mme", "\u03c6\u03bb\u03cc\u03b3\u03b1 2", "\u706b\u7130", "\u0644\u0647\u0628",
        "\u043f\u043b\u0430\u043c\u044f", "\u0932\u0914", "\ubd88\uaf43", "\u05dc\u05d4\u05d1\u05d4",
        "\u0634\u0639\u0644\u0647\u200c\u0647\u0627", "e\u0301t\u00e9", "\U0001F525"}) {
    EXPECT_TRUE(check_session_name(name)) << name;
  }
  std::string longest;
  while (longest.size() + 3 <= 200) longest += "\u706b";
  EXPECT_TRUE(check_session_name(longest));
  EXPECT_FALSE(check_session_name(longest + "\u706b")) << "bytes are counted, as the disk does";
}

TEST(SessionName, WhatCannotBeSeenOrLooksLikeAnotherIsRefused) {
  for (const char* name :
       {"a\u202eb",     "a\u200bb",         "a\u2066b",    "a\ufeff",  "a\u00a0b",     "a\u3000b",
        "\u2028",       "a\u0085b",         "a\uff0fb",    "a\u2215b", "\uff0e\uff0e", "\u2025",
        "a\ue000",      "a\ufffe",          "a\U000E0041", "a\ufffd",  "\xc0\xae",     "\xe0\x80\xaf",
        "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xe7\x81",    "a\x80"}) {
    const Status status = check_session_name(name);
    ASSERT_FALSE(status) << name;
    EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
    for (const char c : status.error().message()) EXPECT_TRUE(c >= ' ' && c <= '~');
  }
}

TEST(SessionName, AMarkBelongsToALetter) {
  EXPECT_FALSE(check_session_name("\u0301a"));
  EXPECT_FALSE(check_session_name("a\u200d"));
}

TEST(SessionName, IsStoredAsOneHoweverItWasTyped) {
  EXPECT_EQ(stored_name("e\u0301te\u0301"), "\u00e9t\u00e9");
  EXPECT_EQ(stored_name("a\u0323\u0302"), "\u1ead") << "two marks";
  EXPECT_EQ(stored_name("\u1107\u116e\u11af"), "\ubd88") << "Hangul";
  EXPECT_EQ(stored_name("\u304b\u3099"), "\u304c") << "kana";
  for (const char* name : {"flame", "\u00e9t\u00e9", "\u706b\u7130", "x\u0301", "\u0644\u0647\u0628"})
    EXPECT_EQ(stored_name(name), name);
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

TEST(SessionName, ForeignTextMovesNoTerminalsCursor) {
  EXPECT_EQ(printable("Flamme 3 \u00e9\u706b"), "Flamme 3 \u00e9\u706b");
  EXPECT_EQ(printable("\x1b[2J\r\n\x7f\u009b"), "?[2J????");
  EXPECT_EQ(printable("\xff\x9b\x1b[ and \xc3"), "???[ and ?");
}

TEST(SessionName, WhatWindowsCannotHoldIsRefused) {
  for (const char* name : {"con", "NUL", "Com7", "lpt1.log", "aux .txt", "ends.", "ends "}) {
    EXPECT_FALSE(check_session_name(name)) << name;
  }
}

}  // namespace
}  // namespace emberlock::session
