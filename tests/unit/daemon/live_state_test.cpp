// SPDX-License-Identifier: Apache-2.0
// What a child's messages say of a recording's live volumes.
#include <csignal>
#include <limits>
#include <string>

#include <gmock/gmock.h>

#include "daemon/engine/words.h"
#include "daemon/live/live_volumes.h"
#include "daemon/live/state.h"
#include "tests/support/child_script.h"

namespace emberlock::daemon {
namespace {
using testing::HasSubstr;
using Live = v1::LiveStatus;

TimePoint instant(double s) { return TimePoint{1'000'000'000} + Seconds(s); }

v1::ChildMessage volume_message(std::uint64_t frame, double filmed_s, std::uint64_t skipped = 0) {
  v1::ChildMessage message;
  v1::LiveFrame& live = *message.mutable_live_frame();
  live.set_frame(frame);
  live.set_filmed_ns(instant(filmed_s).ns);
  live.set_skipped(skipped);
  live.set_voxels(48);
  live.set_seconds(0.4);
  live.set_takes_s(0.3);
  live.set_keeps_up(true);
  test::fill(*live.mutable_volume(), 2, 1, 1, "ab");
  return message;
}

class LiveStateTest : public testing::Test {
 protected:
  static v1::LiveRequest every(std::uint32_t frames) {
    v1::LiveRequest request;
    request.set_every(frames);
    return request;
  }
  LiveState state_{"take 1", every(6)};
};

TEST_F(LiveStateTest, TheDelayIsFromAFramesArrivalUntilItsVolumeIsShown) {
  EXPECT_EQ(state_.status().state(), Live::STARTING);
  const auto shown = state_.take(volume_message(12, 3, 1), instant(3.9));
  ASSERT_TRUE(shown);
  EXPECT_EQ(shown->reconstruction(), "take 1 live");
  EXPECT_EQ(shown->frame(), 12U);
  EXPECT_NEAR(shown->live_delay_s(), 0.9, 1e-9);
  EXPECT_EQ(shown->volume().voxels(), "ab");
  const v1::LiveStatus& status = state_.status();
  EXPECT_EQ(status.state(), Live::RUNNING);
  EXPECT_EQ(status.frame(), 12U);
  EXPECT_NEAR(status.delay_s(), 0.9, 1e-9);
  EXPECT_EQ(status.skipped(), 1U);
  EXPECT_EQ(status.volumes(), 1U);
  EXPECT_EQ(status.voxels(), 48U);
  EXPECT_DOUBLE_EQ(status.takes_s(), 0.3);
  ASSERT_TRUE(state_.take(volume_message(18, 4), instant(3)));
  EXPECT_EQ(state_.status().delay_s(), 0) << "no clock goes backwards";
}

TEST_F(LiveStateTest, AFrameWithoutFlameCountsAndSaysWhyWhileThereIsNoVolume) {
  v1::ChildMessage dark;
  dark.mutable_live_frame()->set_failure("no flame is seen");
  EXPECT_FALSE(state_.take(std::move(dark), instant(1)));
  EXPECT_EQ(state_.status().without_flame(), 1U);
  EXPECT_EQ(state_.status().state(), Live::STARTING);
  EXPECT_EQ(words(state_.reason()), "no volume yet: no flame is seen");
  state_.take(volume_message(6, 1), instant(2));
  EXPECT_EQ(words(state_.reason()), "");
}

TEST_F(LiveStateTest, WhatDoesNotHoldTogetherIsNotShown) {
  v1::ChildMessage broken = volume_message(6, 1);
  broken.mutable_live_frame()->mutable_volume()->set_nx(200);
  EXPECT_FALSE(state_.take(std::move(broken), instant(2)));
  v1::ChildMessage times = volume_message(6, 1);
  times.mutable_live_frame()->set_takes_s(std::numeric_limits<double>::quiet_NaN());
  times.mutable_live_frame()->set_seconds(-1);
  const auto shown = state_.take(std::move(times), instant(2));
  ASSERT_TRUE(shown);
  EXPECT_EQ(shown->iteration().seconds(), 0);
  EXPECT_EQ(state_.status().takes_s(), 0);
}

TEST_F(LiveStateTest, OneThatDoesNotKeepUpSaysWhatWouldHold) {
  v1::ChildMessage slow = volume_message(6, 1, 30);
  slow.mutable_live_frame()->set_keeps_up(false);
  slow.mutable_live_frame()->set_holds_every(20);
  slow.mutable_live_frame()->set_holds_voxels(32);
  state_.take(std::move(slow), instant(2));
  EXPECT_FALSE(state_.status().keeps_up());
  EXPECT_EQ(words(state_.reason()),
            "doesn't keep up: a volume of 48 voxels takes 0.30 s, and each 6 frames "
            "are asked for. --every 20 or --voxels 32 would hold");
}

TEST_F(LiveStateTest, PausesAndGoesOn) {
  state_.take(volume_message(6, 1), instant(2));
  state_.yield(LiveYield::Verdict::pause, QueueFills{0.4});
  EXPECT_EQ(state_.status().state(), Live::PAUSED);
  EXPECT_THAT(words(state_.reason()), HasSubstr("40 %"));
  state_.yield(LiveYield::Verdict::run, {});
  EXPECT_EQ(state_.status().state(), Live::RUNNING);
  state_.yield(LiveYield::Verdict::stop, FramesLostBeside{1});
  state_.ended();
  EXPECT_EQ(state_.status().state(), Live::STOPPED) << "also after the recording's end";
  EXPECT_FALSE(state_.take(volume_message(12, 3), instant(4)));
}

TEST_F(LiveStateTest, EachWayToFailHasItsWords) {
  const auto failed = [](const ChildEnd& end, const std::string& last_words = {}) {
    LiveState state("take 1", {});
    state.failed(end, last_words);
    EXPECT_EQ(state.status().state(), Live::FAILED);
    return words(state.reason());
  };
  EXPECT_THAT(failed({.signal = SIGKILL}), HasSubstr("memory"));
  EXPECT_THAT(failed({.signal = SIGSEGV}, "a word"), HasSubstr("crashed by signal 11. It said: a word"));
  EXPECT_THAT(failed({.code = 3}), HasSubstr("exit code 3"));
  EXPECT_EQ(failed({.why = ChildEnd::Why::not_started, .words = "no such file"}), "no such file");
  EXPECT_THAT(failed({.why = ChildEnd::Why::silent}), HasSubstr("told nothing"));
  EXPECT_THAT(failed({.why = ChildEnd::Why::unreadable}), HasSubstr("of one version"));
  v1::ChildMessage told;
  told.mutable_failure()->set_message("not enough memory");
  state_.take(std::move(told), instant(1));
  state_.failed({.code = 1}, "");
  EXPECT_EQ(words(state_.reason()), "not enough memory");
}

TEST(LiveRequests, NumbersOutOfRangeAreNamed) {
  v1::LiveRequest request;
  EXPECT_TRUE(check_live(request).ok());
  request.set_voxels(4);
  EXPECT_THAT(check_live(request).error().message(), HasSubstr("live.voxels"));
  request.set_voxels(2000);
  EXPECT_EQ(check_live(request).error().kind, ErrorKind::bad_input);
  request.set_voxels(64);
  request.set_every(2'000'000);
  EXPECT_THAT(check_live(request).error().message(), HasSubstr("live.every"));
}

}  // namespace
}  // namespace emberlock::daemon
