// SPDX-License-Identifier: Apache-2.0
// When live volumes give way to the recording.
#include <variant>
#include <vector>

#include <gmock/gmock.h>

#include "daemon/engine/words.h"
#include "daemon/live/yield.h"

namespace emberlock::daemon {
namespace {
using testing::HasSubstr;
using Verdict = LiveYield::Verdict;

TimePoint at_second(double s) { return TimePoint{} + Seconds(s); }

RecordingLoad filled(double share) {
  RecordingLoad load;
  load.queue_fill = share;
  return load;
}

TEST(LiveYield, RunsWhileTheRecordingIsWell) {
  LiveYield yield;
  for (int i = 0; i < 100; ++i) EXPECT_EQ(yield.look(filled(0.2), at_second(0.05 * i)), Verdict::run);
  EXPECT_TRUE(std::holds_alternative<std::monostate>(yield.reason()));
}

TEST(LiveYield, PausesLongBeforeAFrameIsLostAndGoesOnAfterASecondOfCalm) {
  LiveYield yield;
  ASSERT_EQ(yield.look(filled(0.1), at_second(0)), Verdict::run);
  EXPECT_EQ(yield.look(filled(0.4), at_second(1)), Verdict::pause);
  EXPECT_THAT(words(yield.reason()), HasSubstr("queue is at 40 %"));
  EXPECT_EQ(yield.look(filled(0.2), at_second(1.5)), Verdict::pause)
      << "it is less than it was, and not little";
  EXPECT_EQ(yield.look(filled(0.1), at_second(2)), Verdict::pause);
  EXPECT_EQ(yield.look(filled(0.1), at_second(2.9)), Verdict::pause);
  EXPECT_EQ(yield.look(filled(0.2), at_second(2.95)), Verdict::pause) << "no calm";
  EXPECT_EQ(yield.look(filled(0.1), at_second(3)), Verdict::pause);
  EXPECT_EQ(yield.look(filled(0.1), at_second(4.01)), Verdict::run);
}

TEST(LiveYield, PausesForADiskThatIsBehindAndForCamerasThatWantTheProcessor) {
  RecordingLoad behind;
  behind.at_risk = Seconds(0.9);
  LiveYield yield;
  EXPECT_EQ(yield.look(behind, at_second(0)), Verdict::pause);
  EXPECT_THAT(words(yield.reason()), HasSubstr("waited 0.9 s for the disk"));
  RecordingLoad overworked;
  overworked.overworked = true;
  LiveYield other;
  EXPECT_EQ(other.look(overworked, at_second(0)), Verdict::pause);
  EXPECT_THAT(words(other.reason()), HasSubstr("need the processor"));
}

TEST(LiveYield, EndsWithTheFirstFrameThatIsLostBesideIt) {
  LiveYield yield;
  RecordingLoad load;
  ASSERT_EQ(yield.look(load, at_second(0)), Verdict::run);
  load.lost = 2;
  EXPECT_EQ(yield.look(load, at_second(1)), Verdict::stop);
  EXPECT_THAT(words(yield.reason()), HasSubstr("lost 2 frames"));
  EXPECT_EQ(yield.look({}, at_second(100)), Verdict::stop) << "for the rest of the recording";
}

TEST(LiveYield, EndsWhenItHasToPauseAgainAndAgain) {
  LiveYield yield;
  double now = 0;
  for (int pause = 0; pause < LiveYield::kMostPauses; ++pause) {
    ASSERT_EQ(yield.look(filled(0.5), at_second(now += 1)), Verdict::pause) << pause;
    ASSERT_EQ(yield.look(filled(0), at_second(now += 1)), Verdict::pause);
    ASSERT_EQ(yield.look(filled(0), at_second(now += 1.01)), Verdict::run);
  }
  EXPECT_EQ(yield.look(filled(0.5), at_second(now + 1)), Verdict::stop);
  EXPECT_THAT(words(yield.reason()), HasSubstr("more than 10 times"));
}

}  // namespace
}  // namespace emberlock::daemon
