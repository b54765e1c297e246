// SPDX-License-Identifier: Apache-2.0
#include "session/frame_range.h"

#include <limits>

#include <gmock/gmock.h>

namespace emberlock::session {
namespace {
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

constexpr auto kMost = std::numeric_limits<std::uint64_t>::max();

std::string refusal_of(const FrameRange& range, std::uint64_t recorded) {
  const auto frames = frames_of(range, recorded, "last_frame");
  return frames.ok() ? "" : frames.error().message();
}

TEST(FrameRange, BothEndsBelongToItAndStepsMayPassTheLast) {
  EXPECT_THAT(*frames_of({7, 7, 1}, 40, "x"), ElementsAre(7));
  EXPECT_THAT(*frames_of({7, 10, 1}, 40, "x"), ElementsAre(7, 8, 9, 10));
  EXPECT_THAT(*frames_of({0, 10, 4}, 40, "x"), ElementsAre(0, 4, 8));
  EXPECT_THAT(*frames_of({5, 10, kMost}, 40, "x"), ElementsAre(5));
  EXPECT_THAT(*frames_of({0, 999, 1}, 2000, "x"), SizeIs(1000));
}

TEST(FrameRange, WhatItRefusesNamesFieldReasonAndRemedy) {
  EXPECT_EQ(refusal_of({7, 6, 1}, 40),
            "last_frame: 6 lies before the first frame, 7. Give the first frame, or a later one");
  EXPECT_EQ(refusal_of({7, 40, 1}, 40),
            "last_frame: there is no frame 40: the session has 40. Choose among 0 to 39");
  EXPECT_THAT(refusal_of({0, 1000, 1}, 2000), HasSubstr("0 to 1000 are 1001 frames. Choose at most 1000"));
  EXPECT_THAT(refusal_of({0, kMost - 1, 1}, kMost), HasSubstr("at most 1000"));
  EXPECT_THAT(refusal_of({0, 0, 1}, 0), HasSubstr("another session"));
}

}  // namespace
}  // namespace emberlock::session
