// SPDX-License-Identifier: Apache-2.0
#include "session/child_messages.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>

namespace emberlock::session {
namespace {
using testing::ElementsAre;
using testing::HasSubstr;

std::string progress(const std::string& doing) {
  v1::ChildMessage message;
  message.mutable_progress()->set_doing(doing);
  return framed(message);
}

struct Parsed {
  std::vector<std::string> doing;
  std::string error;
};

/// In pieces of `piece` bytes.
Parsed parse(const std::string& bytes, std::size_t piece) {
  Parsed parsed;
  ChildMessageParser parser;
  for (std::size_t at = 0; at < bytes.size() && parsed.error.empty(); at += piece) {
    const Status status =
        parser.add(std::string_view(bytes).substr(at, piece),
                   [&](v1::ChildMessage&& message) { parsed.doing.push_back(message.progress().doing()); });
    if (!status) parsed.error = status.error().message();
  }
  return parsed;
}

TEST(ChildMessages, AreTheSameInWhateverPiecesTheyCome) {
  const std::string bytes = progress("one") + progress(std::string(300, 'x')) + progress("three");
  for (const std::size_t piece : {1, 2, 7, 100, 1000}) {
    const Parsed parsed = parse(bytes, piece);
    EXPECT_THAT(parsed.doing, ElementsAre("one", std::string(300, 'x'), "three")) << piece;
    EXPECT_EQ(parsed.error, "");
  }
}

TEST(ChildMessages, OneThatIsCutOffIsNotTaken) {
  const std::string bytes = progress("one") + progress("two");
  EXPECT_THAT(parse(bytes.substr(0, bytes.size() - 1), 3).doing, ElementsAre("one"));
}

TEST(ChildMessages, WhatCameBeforeGarbageIsTaken) {
  const Parsed parsed = parse(progress("one") + "\x04\xff\xff\xff\xff", 100);
  EXPECT_THAT(parsed.doing, ElementsAre("one"));
  EXPECT_THAT(parsed.error, HasSubstr("no message"));
}

TEST(ChildMessages, ALengthThatWouldFillTheMemoryIsRefusedBeforeItsBytesCome) {
  EXPECT_THAT(parse("\xff\xff\xff\x7f", 1).error, HasSubstr("over"));
  EXPECT_NE(parse("\x80\x80\x80\x80\x80\x80\x80\x80", 8).error, "") << "a length without an end";
}

}  // namespace
}  // namespace emberlock::session
