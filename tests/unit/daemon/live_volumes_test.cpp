// SPDX-License-Identifier: Apache-2.0
// Live volumes' child process, played by a shell script.
#include "daemon/live/live_volumes.h"

#include <fstream>
#include <memory>
#include <string>

#include <gmock/gmock.h>

#include "base/clock.h"
#include "tests/support/child_script.h"
#include "tests/support/recording.h"
#include "tests/support/wait.h"

namespace emberlock::daemon {
namespace {
using testing::HasSubstr;
using Live = v1::LiveStatus;

class LiveVolumesThreads : public testing::Test {
 protected:
  /// `cat $ROOT/volume >&3` sends a volume.
  void start(const std::string& script) {
    v1::ChildMessage message;
    v1::LiveFrame& live = *message.mutable_live_frame();
    live.set_frame(12);
    live.set_filmed_ns((SteadyClock().now() - Seconds(0.5)).ns);
    live.set_keeps_up(true);
    test::fill(*live.mutable_volume(), 1, 1, 1, "a");
    test::put_message(root_ / "volume", message);
    test::put_script(root_.path(), script);
    LiveOptions options;
    options.program = root_ / "program";
    live_ = std::make_unique<LiveVolumes>(options, board_);
    live_->start(root_ / "take 1", {});
  }
  bool reach(Live::State state) {
    return test::wait_until([&] { return live_->status()->state() == state; });
  }
  void offer(double fill = 0, std::uint64_t lost = 0) {
    RecordingLoad load;
    load.queue_fill = fill;
    load.lost = lost;
    live_->offer({1, 1}, load);
  }
  [[nodiscard]] std::string pid() const {
    std::ifstream in(root_ / "pid");
    std::string text;
    std::getline(in, text);
    return text;
  }
  /// "R", "S", "T" (stopped) as ps shows it; empty: gone.
  [[nodiscard]] std::string process_state() const {
    std::ifstream stat("/proc/" + pid() + "/stat");
    std::string text;
    std::getline(stat, text);
    const auto bracket = text.find(") ");
    return bracket == std::string::npos ? "" : text.substr(bracket + 2, 1);
  }

  test::TempFolder root_;
  Board board_;
  std::unique_ptr<LiveVolumes> live_;
};

TEST_F(LiveVolumesThreads, AVolumeIsShownWithItsDelay) {
  start("cat $ROOT/volume >&3; exec sleep 100");
  ASSERT_TRUE(reach(Live::RUNNING));
  const v1::LiveStatus status = *live_->status();
  EXPECT_EQ(status.session(), "take 1");
  EXPECT_EQ(status.frame(), 12U);
  EXPECT_GE(status.delay_s(), 0.5);
  ASSERT_TRUE(test::wait_until([&] { return board_.iterations(0).size() == 1; })) << "behind the status";
  EXPECT_EQ(board_.iterations(0).back()->live_delay_s(), status.delay_s());
  live_->stop();
  EXPECT_FALSE(live_->runs());
  EXPECT_EQ(live_->status()->state(), Live::ENDED);
  EXPECT_TRUE(board_.notices(0).empty());
}

TEST_F(LiveVolumesThreads, TheChildIsToldTheSessionFirstAndRunsAtTheLowestPriority) {
  // The parent lowers it when it has started it.
  start(
      "until [ $(nice) = 19 ]; do sleep 0.01; done; head -c 3 > $ROOT/head; cat $ROOT/volume >&3; exec sleep "
      "100");
  ASSERT_TRUE(reach(Live::RUNNING)) << "at the lowest priority";
  EXPECT_EQ(test::bytes_of(root_ / "head").size(), 3U);
}

TEST_F(LiveVolumesThreads, ItStandsStillWhileTheRecordingHasTroubleAndGoesOn) {
  start("echo $$ > $ROOT/pid.new; mv $ROOT/pid.new $ROOT/pid; cat $ROOT/volume >&3; exec sleep 100");
  ASSERT_TRUE(reach(Live::RUNNING));
  offer(0.6);
  ASSERT_TRUE(reach(Live::PAUSED));
  EXPECT_THAT(live_->status()->reason(), HasSubstr("goes first"));
  EXPECT_TRUE(test::wait_until([&] { return process_state() == "T"; }));
  EXPECT_TRUE(test::wait_until([&] {
    offer();
    return live_->status()->state() == Live::RUNNING;
  }));
  EXPECT_TRUE(test::wait_until([&] { return process_state() == "S"; }));
}

TEST_F(LiveVolumesThreads, ItEndsWithAFrameThatTheRecordingLoses) {
  start("cat $ROOT/volume >&3; exec sleep 100");
  ASSERT_TRUE(reach(Live::RUNNING));
  offer(0, 1);
  ASSERT_TRUE(reach(Live::STOPPED));
  ASSERT_TRUE(test::wait_until([&] { return !board_.notices(0).empty(); }));
  EXPECT_THAT(board_.notices(0).back().text(), HasSubstr("goes on without live volumes"));
  EXPECT_THAT(board_.notices(0).back().text(), HasSubstr("lost 1 frame"));
  EXPECT_EQ(live_->status()->state(), Live::STOPPED);
}

TEST_F(LiveVolumesThreads, AChildThatDiesIsTold) {
  start("kill -9 $$");
  ASSERT_TRUE(reach(Live::FAILED));
  EXPECT_THAT(live_->status()->reason(), HasSubstr("was killed"));
  ASSERT_TRUE(test::wait_until([&] { return !board_.notices(0).empty(); }));
  EXPECT_FALSE(live_->runs());
  start("echo nonsense >&2; exit 3");
  ASSERT_TRUE(reach(Live::FAILED));
  EXPECT_THAT(live_->status()->reason(), HasSubstr("exit code 3"));
  EXPECT_THAT(live_->status()->reason(), HasSubstr("nonsense"));
  start("head -c 100 /dev/zero | tr '\\0' '\\377' >&3; exec sleep 100");
  ASSERT_TRUE(reach(Live::FAILED));
  EXPECT_THAT(live_->status()->reason(), HasSubstr("can't be understood"));
}

TEST_F(LiveVolumesThreads, WithoutTheProgramThereAreNone) {
  LiveOptions options;
  options.program = root_ / "nowhere";
  live_ = std::make_unique<LiveVolumes>(options, board_);
  EXPECT_FALSE(live_->status());
  live_->start(root_ / "take 1", {});
  ASSERT_TRUE(reach(Live::FAILED));
  EXPECT_THAT(live_->status()->reason(), HasSubstr("nowhere"));
}

}  // namespace
}  // namespace emberlock::daemon
