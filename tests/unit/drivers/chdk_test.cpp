// SPDX-License-Identifier: Apache-2.0
// CHDK's commands and its live view, against a camera of tests/support/chdk_responder.
#include "drivers/ptp/chdk.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/ptp/live_view.h"
#include "tests/support/chdk_responder/bench.h"

namespace emberlock::drivers {
namespace {

using chdk_responder::OpenBench;
using testing::ElementsAre;
using testing::HasSubstr;

Result<PtpAnswer> live_view(OpenBench& bench) {
  const Status asked = bench.chdk.ask_for_live_view();
  return asked.ok() ? bench.session.finish(Seconds(1)) : asked.error();
}

TEST(Chdk, SaysItsVersion) {
  OpenBench bench;
  const auto version = bench.chdk.version();
  ASSERT_TRUE(version.ok()) << version.error().message();
  EXPECT_EQ(version->major, 2u);
  EXPECT_EQ(version->minor, 9u);
}

TEST(Chdk, IsMissedWithAnErrorWhereTheFirmwareIsCanonsOwn) {
  OpenBench bench({.chdk = false});
  const auto version = bench.chdk.version();
  ASSERT_FALSE(version.ok());
  EXPECT_THAT(version.error().message(), HasSubstr("refuses CHDK: operation not supported"));
}

TEST(Chdk, AScriptReturnsItsValuesByType) {
  OpenBench bench;
  EXPECT_THAT(bench.chdk.run("return get_mode()").value(),
              ElementsAre(ChdkValue(false), ChdkValue(false), ChdkValue(2)));
}

TEST(Chdk, WhatAScriptWritesComesAsMessagesInOrder) {
  OpenBench bench;
  const std::uint32_t script =
      bench.chdk.start_script("write_usb_msg(\"one\"); write_usb_msg(\"two\")").value();
  for (const char* text : {"one", "two"}) {
    const auto message = bench.chdk.read_message();
    ASSERT_TRUE(message.ok());
    EXPECT_EQ(message->type, ChdkMessageType::user);
    EXPECT_EQ(message->script, script);
    EXPECT_EQ(std::get<std::string>(message->value), text);
  }
  EXPECT_EQ(bench.chdk.read_message()->type, ChdkMessageType::none);
}

TEST(Chdk, AScriptHearsWhatIsWrittenToIt) {
  OpenBench bench;
  ASSERT_TRUE(bench.chdk.start_script("return read_usb_msg(1000)").ok());
  EXPECT_TRUE(bench.chdk.script_status()->running);
  ASSERT_TRUE(bench.chdk.write_message("go").ok());
  EXPECT_TRUE(bench.chdk.script_status()->message_waits);
  EXPECT_EQ(std::get<std::string>(bench.chdk.read_message()->value), "go");
  const Status nobody = bench.chdk.write_message("again");
  ASSERT_FALSE(nobody.ok());
  EXPECT_THAT(nobody.error().message(), HasSubstr("no script runs"));
}

TEST(Chdk, AnEmptyMessageNeverReachesTheCamera) {
  OpenBench bench;
  ASSERT_TRUE(bench.chdk.start_script("return read_usb_msg(1000)").ok());
  const int before = bench.device().transactions();
  const Status refused = bench.chdk.write_message("");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(bench.device().transactions(), before);
  EXPECT_FALSE(bench.device().hung_by_empty_message());
}

TEST(Chdk, AScriptThatDoesNotCompileOrFailsSaysWhy) {
  OpenBench bench;
  EXPECT_THAT(bench.chdk.run("sleep((1)").error().message(), HasSubstr("unexpected symbol"));
  EXPECT_THAT(bench.chdk.run("error(\"no card\")").error().message(), HasSubstr("no card"));
  EXPECT_THAT(bench.chdk.run("brew()").error().message(), HasSubstr("attempt to call"));
}

TEST(Chdk, MessagesLeftByAnEarlierScriptAreNotTakenForThisOnes) {
  OpenBench bench;
  ASSERT_TRUE(bench.chdk.start_script("return get_mode()").ok());
  EXPECT_THAT(bench.chdk.run("return get_movie_status()").value(), ElementsAre(ChdkValue(0)));
}

TEST(Chdk, AScriptThatDoesNotEndIsLeftAtTheDeadline) {
  OpenBench bench;
  const TimePoint begin = bench.clock->now();
  const auto endless = bench.chdk.run("sleep(100000)", Seconds(0.5));
  ASSERT_FALSE(endless.ok());
  EXPECT_EQ(endless.error().kind, ErrorKind::timed_out);
  EXPECT_LE((bench.clock->now() - begin).value(), 0.6);
}

TEST(Chdk, AMovieStartsRecordsAndIsSaved) {
  OpenBench bench;
  bench.record();
  const auto after = [&](Seconds pause) {
    bench.pass(pause);
    return bench.chdk.movie().value();
  };
  EXPECT_EQ(bench.chdk.movie().value(), ChdkMovie::stopped);
  ASSERT_TRUE(bench.chdk.press_movie_button().ok());
  EXPECT_EQ(after(Seconds(0.5)), ChdkMovie::recording);
  ASSERT_TRUE(bench.chdk.press_movie_button().ok());
  EXPECT_EQ(after(Seconds(0)), ChdkMovie::saving);
  EXPECT_EQ(after(Seconds(0.5)), ChdkMovie::stopped);
  EXPECT_EQ(bench.session.objects()->size(), 1u);
}

TEST(ChdkMessage, NumbersOfTheWrongLengthAndMissingDataAreRefused) {
  const auto four = std::vector<std::byte>(4);
  EXPECT_TRUE(parse_chdk_message({0x2001, {2, 3, 1, 4}, four}).ok());
  EXPECT_FALSE(parse_chdk_message({0x2001, {2, 3, 1, 3}, four}).ok());
  EXPECT_FALSE(parse_chdk_message({0x2001, {2, 4, 1, 5}, four}).ok());
  EXPECT_FALSE(parse_chdk_message({0x2001, {4, 4, 1, 4}, four}).ok());
  EXPECT_EQ(parse_chdk_message({0x2001, {}, {}})->type, ChdkMessageType::none);
}

struct ChdkModel {
  const char* name;
  int type;
};
class ChdkLiveView : public testing::TestWithParam<ChdkModel> {};
INSTANTIATE_TEST_SUITE_P(Cameras, ChdkLiveView,
                         testing::Values(ChdkModel{"Digic4", 0}, ChdkModel{"Digic6", 3}),
                         [](const auto& shown) { return shown.param.name; });

TEST_P(ChdkLiveView, ComesAsBrightnessAndAsColour) {
  OpenBench bench({.live_view_type = GetParam().type, .live_view = {354, 40}});
  bench.record();
  const auto answer = live_view(bench);
  ASSERT_TRUE(answer.ok()) << answer.error().message();
  const auto view = parse_live_view(answer->data);
  ASSERT_TRUE(view.ok()) << view.error().message();
  ASSERT_TRUE(view->has_value());
  const Image gray = image_of(**view, PixelFormat::gray8);
  const Image rgb = image_of(**view, PixelFormat::rgb8);
  ASSERT_EQ(gray.layout().size, (ImageSize{354, 40}));
  // BT.601 with full range, of U - 128 = 10 and V - 128 = -20.
  const auto expect = [](double v) { return std::clamp(static_cast<int>(std::lround(v)), 0, 255); };
  for (int y = 1; y < 40; ++y) {
    for (int x = 0; x < 354; ++x) {
      const int brightness = (x + 3 * y) & 0xff;
      ASSERT_EQ(gray.view().sample(x, y), brightness) << x << ' ' << y;
      ASSERT_EQ(rgb.view().sample(x, y, 0), expect(brightness + 1.402 * -20)) << x << ' ' << y;
      ASSERT_EQ(rgb.view().sample(x, y, 1), expect(brightness - 0.344136 * 10 - 0.714136 * -20));
      ASSERT_EQ(rgb.view().sample(x, y, 2), expect(brightness + 1.772 * 10));
    }
  }
}

TEST(ChdkLiveView, IsAbsentInPlaybackMode) {
  OpenBench bench;
  const auto view = parse_live_view(live_view(bench)->data);
  ASSERT_TRUE(view.ok()) << view.error().message();
  EXPECT_FALSE(view->has_value());
}

TEST(ChdkLiveView, EveryTruncationIsRefused) {
  OpenBench bench({.live_view = {8, 3}, .buffer_width = 8});
  bench.record();
  const auto whole = live_view(bench)->data;
  ASSERT_TRUE(parse_live_view(whole).ok());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(parse_live_view(std::span(whole).first(size)).ok()) << size;
  }
}

TEST(ChdkLiveView, DescriptionsThatCannotBeAreRefused) {
  OpenBench bench({.live_view = {8, 3}, .buffer_width = 8});
  bench.record();
  const auto whole = live_view(bench)->data;
  const auto with = [&](std::size_t word, std::uint32_t value) {
    auto changed = whole;
    for (std::size_t i = 0; i < 4; ++i) changed[4 * word + i] = static_cast<std::byte>(value >> (8 * i));
    return parse_live_view(changed).ok();
  };
  constexpr std::size_t kVersion = 0, kViewport = 5, kType = 8, kStart = 9, kBufferWidth = 10, kWidth = 11,
                        kHeight = 12;
  EXPECT_TRUE(with(kVersion, 2));
  EXPECT_FALSE(with(kVersion, 3));
  EXPECT_FALSE(with(kViewport, 0xfffffff0));
  EXPECT_FALSE(with(kType, 1));
  EXPECT_FALSE(with(kStart, 0xffffffff));
  EXPECT_FALSE(with(kBufferWidth, 4));
  EXPECT_FALSE(with(kBufferWidth, 10));
  EXPECT_FALSE(with(kBufferWidth, 0x7ffffffc));
  EXPECT_FALSE(with(kWidth, 0));
  EXPECT_FALSE(with(kWidth, 0x80000000));
  EXPECT_FALSE(with(kHeight, 0));
  EXPECT_FALSE(with(kHeight, 0x40000000));
}

}  // namespace
}  // namespace emberlock::drivers
