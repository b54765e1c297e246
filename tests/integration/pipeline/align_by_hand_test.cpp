// SPDX-License-Identifier: Apache-2.0
// Cameras that people reset, who say nothing of it: whom they are asked for, and how soon it is seen.
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/align/alignment.h"
#include "tests/support/aligned.h"

namespace emberlock {
namespace {

using test::expect_replays;
using test::small_rig;
using test::SmallBench;
using testing::Contains;
using testing::HasSubstr;

/// What a press of a button takes until frames come again, at most; and then two rounds.
constexpr Seconds kSeenWithin{1.2};

/// A camera whose plug somebody pulls.
class PluggedCamera final : public drivers::Camera {
 public:
  PluggedCamera(drivers::Camera& camera, Clock& clock) : camera_(camera), clock_(clock) {}
  void unplug_until(TimePoint until) { gone_until_ = until; }

  [[nodiscard]] const drivers::CameraInfo& info() const override { return camera_.info(); }
  [[nodiscard]] drivers::FrameCounts counts() const override { return camera_.counts(); }
  Status start() override {
    if (clock_.now() < gone_until_) return Error{ErrorKind::device, "it isn't there", info().id, {}};
    if (gone_until_ != TimePoint{}) {
      camera_.stop();  // power was off: its phase is drawn anew
      gone_until_ = {};
    }
    return camera_.start();
  }
  void stop() override { camera_.stop(); }
  Result<Frame> next_frame(Seconds deadline) override {
    if (gone_until_ != TimePoint{}) return Error{ErrorKind::device, "it went away", info().id, {}};
    return camera_.next_frame(deadline);
  }
  std::uint64_t pass_over(TimePoint until) override { return camera_.pass_over(until); }
  Status reset_shutter(TimePoint at) override { return camera_.reset_shutter(at); }
  Status trim_rate(PartsPerMillion trim) override { return camera_.trim_rate(trim); }

 private:
  drivers::Camera& camera_;
  Clock& clock_;
  TimePoint gone_until_;
};

class AlignByHand : public testing::Test {
 protected:
  AlignByHand() {
    bench.rig->set_reset(ShutterReset::by_hand);
    bench.options.align.reset_by = smear::ResetBy::anybody;
    bench.options.align.tolerance.amount = Rows(30);
  }

  /// Somebody presses the button of a camera.
  void press(std::size_t camera, Seconds after = Seconds(0.3)) {
    const TimePoint at = bench.align.clock->now() + after;
    ASSERT_TRUE(bench.rig->camera(static_cast<int>(camera)).reset_shutter(at).ok());
    pressed = {camera, at};
  }

  /// Rounds, with what people do after each, until all are aligned or so many were made.
  void run(const std::function<void(const smear::AlignDecision&)>& people, int rounds = 400) {
    if (!alignment) {
      alignment = rig::Alignment::create(bench.align, bench.options).value();
      ASSERT_TRUE(alignment->start().ok());
    }
    for (int i = 0; i < rounds; ++i) {
      const auto done = alignment->round();
      ASSERT_TRUE(done.ok()) << done.error().message();
      const smear::AlignDecision& last = alignment->last();
      if (pressed && std::find(last.jumped.begin(), last.jumped.end(), pressed->first) != last.jumped.end()) {
        longest = std::max(longest, alignment->at() - pressed->second);
        pressed.reset();
        ++noticed;
      }
      if (pressed && alignment->at() - pressed->second > Seconds(3)) {
        ++unseen;  // it landed where it had been: the people press again if they are asked
        pressed.reset();
      }
      if (last.verdict != smear::AlignVerdict::go_on) return;
      people(last);
    }
  }

  SmallBench bench{small_rig(7, 3)};
  std::unique_ptr<rig::Alignment> alignment;
  std::optional<std::pair<std::size_t, TimePoint>> pressed;
  Seconds longest;  ///< from a press to the round that saw it
  int noticed = 0;
  int unseen = 0;
};

TEST_F(AlignByHand, WhoPressesWhatIsAskedForGetsThere) {
  int presses = 0;
  run([&](const smear::AlignDecision& last) {
    for (const smear::CameraDecision& camera : last.cameras)
      EXPECT_FALSE(camera.reset) << "nobody is told to";
    if (pressed || !last.reset_next) return;
    EXPECT_THAT(alignment->words().cameras[*last.reset_next], HasSubstr("reset its shutter by hand"));
    press(*last.reset_next);
    ++presses;
  });
  ASSERT_EQ(alignment->last().verdict, smear::AlignVerdict::aligned) << alignment->words().reason;
  EXPECT_GT(presses, 0);
  EXPECT_EQ(noticed, presses);
  EXPECT_EQ(alignment->resets(), presses);
  EXPECT_LT(longest, kSeenWithin);
  const SecondsPerRow row = alignment->options().row_time;
  EXPECT_LT(bench.true_error(row), Rows(31));
}

TEST_F(AlignByHand, AWrongCameraIsNoticedAsWell) {
  int wrong = 0;
  run(
      [&](const smear::AlignDecision& last) {
        if (pressed || !last.reset_next) return;
        const std::size_t other = (*last.reset_next + 1) % last.cameras.size();
        press(wrong < 3 ? other : *last.reset_next);
        ++wrong;
      },
      600);
  ASSERT_EQ(alignment->last().verdict, smear::AlignVerdict::aligned) << alignment->words().reason;
  EXPECT_GE(noticed, 3);
  EXPECT_LE(unseen, 1);
  EXPECT_LT(longest, kSeenWithin);
  EXPECT_LT(bench.true_error(alignment->options().row_time), Rows(31));
}

TEST_F(AlignByHand, WhoNeverPressesIsWaitedFor) {
  bench.options.align.max_rounds = 10;
  std::optional<std::size_t> asked;
  run(
      [&](const smear::AlignDecision& last) {
        if (!last.reset_next) return;
        EXPECT_EQ(asked.value_or(*last.reset_next), *last.reset_next) << "the same one all the time";
        asked = last.reset_next;
      },
      40);
  EXPECT_TRUE(asked);
  EXPECT_EQ(alignment->last().verdict, smear::AlignVerdict::go_on) << alignment->words().reason;
  EXPECT_EQ(alignment->resets(), 0);
}

TEST_F(AlignByHand, PressesTwiceAndTooEarlyDoNoHarm) {
  alignment = rig::Alignment::create(bench.align, bench.options).value();
  ASSERT_TRUE(alignment->start().ok());
  press(0);
  int presses = 0;
  run(
      [&](const smear::AlignDecision& last) {
        if (!last.reset_next) return;
        if (pressed && (presses % 2 == 0 || presses > 4)) return;
        press(*last.reset_next, pressed ? Seconds(0.05) : Seconds(0.3));
        ++presses;
      },
      600);
  ASSERT_EQ(alignment->last().verdict, smear::AlignVerdict::aligned) << alignment->words().reason;
  EXPECT_LT(bench.true_error(alignment->options().row_time), Rows(31));
}

TEST_F(AlignByHand, APressOnALockedRigIsSeenByTheNextRoundsAndEndsTheLock) {
  run([&](const smear::AlignDecision& last) {
    if (!pressed && last.reset_next) press(*last.reset_next);
  });
  ASSERT_TRUE(alignment->locked(bench.align.clock->now()));
  pressed.reset();
  press(1, Seconds(0));
  noticed = 0;
  run([&](const smear::AlignDecision& /*last*/) {}, 4);
  EXPECT_EQ(noticed, 1);
  const bool in = bench.true_error(alignment->options().row_time) < Rows(31);
  EXPECT_EQ(alignment->locked(bench.align.clock->now()), in);
}

TEST_F(AlignByHand, ACameraThatIsSwitchedOffIsWaitedForAndDrawnAnew) {
  PluggedCamera plug(bench.rig->camera(2), *bench.align.clock);
  bench.align.cameras[2] = &plug;
  bench.options.align.max_rounds = 10;
  bool pulled = false;
  int away = 0;
  run([&](const smear::AlignDecision& last) {
    if (!pulled && last.round == 3) {
      plug.unplug_until(bench.align.clock->now() + Seconds(8));
      pulled = true;
    }
    if (alignment->state().cameras[2].away) {
      ++away;
      EXPECT_THAT(alignment->words().cameras[2], HasSubstr("sends no frames"));
      return;
    }
    if (!pressed && last.reset_next) press(*last.reset_next);
  });
  EXPECT_GT(away, 5) << "the others are filmed meanwhile";
  ASSERT_EQ(alignment->last().verdict, smear::AlignVerdict::aligned) << alignment->words().reason;
  EXPECT_LT(bench.true_error(alignment->options().row_time), Rows(31));
}

TEST_F(AlignByHand, ARecordingReplaysToTheBitThoughPeoplePressedAndPulled) {
  PluggedCamera plug(bench.rig->camera(2), *bench.align.clock);
  bench.align.cameras[2] = &plug;
  // The operator acts between rounds, on the rig's clock: what is asked then is seen by nobody else.
  int asked = 0;
  const auto people = [&] {
    if (++asked % 60 == 0) press(static_cast<std::size_t>(asked / 60 % 3));
    if (asked == 100) plug.unplug_until(bench.align.clock->now() + Seconds(2));
    return asked > 900;
  };
  const auto rounds = expect_replays(bench, people);
  EXPECT_GT(rounds.size(), 5U);
  EXPECT_THAT(rounds, Contains(HasSubstr("\"jumped\":")));
  EXPECT_THAT(rounds, Contains(HasSubstr("sends no frames")));
}

}  // namespace
}  // namespace emberlock
