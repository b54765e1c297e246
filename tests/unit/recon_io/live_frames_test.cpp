// SPDX-License-Identifier: Apache-2.0
// Volumes of a recording that goes on: which frame is next, with how many voxels, and whether that holds.
#include "recon/pipeline/live_frames.h"

#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/support/ball_scene.h"

namespace emberlock::recon {
namespace {

constexpr double kFilmRate = 25;

std::vector<FrameStamp> stamps_at(const std::vector<double>& periods) {
  std::vector<FrameStamp> stamps;
  for (const double period : periods) {
    FrameStamp stamp;
    stamp.frame_id = stamps.size();
    stamp.monotonic_time = TimePoint{} + Seconds(100 + period / kFilmRate);
    stamps.push_back(stamp);
  }
  return stamps;
}

/// Frames 0..count of cameras that film together.
std::vector<FrameStamp> even_stamps(std::size_t count, double late = 0) {
  std::vector<double> periods;
  for (std::size_t i = 0; i < count; ++i) periods.push_back(static_cast<double>(i) + late);
  return stamps_at(periods);
}

std::optional<std::size_t> next_of(NewestFrames& frames,
                                   const std::vector<std::vector<FrameStamp>>& cameras) {
  std::vector<FramesSoFar> so_far;
  so_far.reserve(cameras.size());
  for (const auto& stamps : cameras) so_far.push_back({&stamps, Hertz(kFilmRate)});
  return frames.next(so_far);
}

TEST(NewestFrames, TheNewestThatEveryCameraHasIsNextAndNoneTwice) {
  NewestFrames frames(0);
  EXPECT_FALSE(next_of(frames, {{}, {}}));
  EXPECT_EQ(next_of(frames, {even_stamps(5), even_stamps(9)}), 4U);
  EXPECT_EQ(frames.skipped(), 4U);
  EXPECT_FALSE(next_of(frames, {even_stamps(5), even_stamps(9)}));
  EXPECT_EQ(next_of(frames, {even_stamps(20), even_stamps(8)}), 7U) << "the second camera has no more";
  EXPECT_EQ(frames.skipped(), 6U);
}

TEST(NewestFrames, EachOfSoManyAlone) {
  NewestFrames frames(10);
  EXPECT_EQ(next_of(frames, {even_stamps(5)}), 0U);
  EXPECT_FALSE(next_of(frames, {even_stamps(10)}));
  EXPECT_EQ(next_of(frames, {even_stamps(11)}), 10U);
  EXPECT_EQ(frames.skipped(), 0U);
  EXPECT_EQ(next_of(frames, {even_stamps(48)}), 40U);
  EXPECT_EQ(frames.skipped(), 2U) << "20 and 30 were overtaken";
}

RC_GTEST_PROP(NewestFrames, ChosenAndSkippedAreAllThatWereWanted, ()) {
  const auto every = *rc::gen::inRange<std::uint64_t>(1, 12);
  NewestFrames frames(every);
  std::size_t known = 0;
  std::uint64_t chosen = 0;
  std::optional<std::size_t> last;
  for (const int more : *rc::gen::container<std::vector<int>>(8, rc::gen::inRange(0, 30))) {
    known += static_cast<std::size_t>(more);
    const auto next = next_of(frames, {even_stamps(known), even_stamps(known, 0.3)});
    if (!next) continue;
    RC_ASSERT(*next % every == 0);
    RC_ASSERT(!last || *next > *last);
    RC_ASSERT(known - *next <= every);
    last = next;
    ++chosen;
    RC_ASSERT(chosen + frames.skipped() == *last / every + 1);
  }
}

TEST(NewestFrames, ACameraThatLostAFrameCostsThatInstantAlone) {
  NewestFrames frames(1);
  const auto lost = stamps_at({0, 1, 2, 3, 6, 7});  // 4 and 5 never came
  EXPECT_EQ(next_of(frames, {even_stamps(6), stamps_at({0, 1, 2, 3})}), 3U);
  EXPECT_EQ(next_of(frames, {even_stamps(8), lost}), 7U);
  auto damaged = even_stamps(10);
  damaged[9].status = FrameStatus::damaged;
  EXPECT_EQ(next_of(frames, {even_stamps(10), damaged}), 8U);
}

TEST(NewestFrames, AFrameIsTakenWhenNoLaterOneCanBeNearer) {
  const TimePoint t = even_stamps(5)[4].monotonic_time;
  const auto has = [&](const std::vector<double>& periods) {
    const auto stamps = stamps_at(periods);
    return has_frame_at({&stamps, Hertz(kFilmRate)}, t);
  };
  EXPECT_TRUE(has({3.6}));
  EXPECT_FALSE(has({3.3})) << "the next may be nearer";
  EXPECT_TRUE(has({3.3, 4.3}));
  EXPECT_FALSE(has({2.8, 5.2})) << "more than a period away";
  EXPECT_FALSE(has({}));
}

TEST(LivePace, LeavesRoomBetweenWantedFrames) {
  EXPECT_FALSE(LivePace({.every = 0, .rate = Hertz(24)}).interval());
  EXPECT_FALSE(LivePace({.every = 3, .rate = Hertz(0)}).interval());
  const LivePace pace{.every = 12, .rate = Hertz(24)};
  EXPECT_DOUBLE_EQ(pace.interval()->value(), 0.5);
  EXPECT_LT(pace.aim(), *pace.interval());
}

VolumeTimes times_of(int voxels, const std::vector<double>& seconds) {
  VolumeTimes times;
  for (const double s : seconds) times.add(voxels, Seconds(s));
  return times;
}

TEST(VolumeTimes, OneThatTheMachineWasKeptFromDoesNotCount) {
  EXPECT_DOUBLE_EQ(times_of(32, {0.2, 9, 0.2, 0.3}).typical().value(), 0.2);
  VolumeTimes times = times_of(32, {5, 5, 5});
  times.add(40, Seconds(1));
  EXPECT_DOUBLE_EQ(times.typical().value(), 1) << "others were of other voxels";
  EXPECT_EQ(times.count(), 1U);
  EXPECT_EQ(VolumeTimes().typical(), Seconds(0));
}

TEST(LiveVoxels, TheirNumberFollowsFromTheTime) {
  const VolumeTimes times = times_of(32, {0.1});
  EXPECT_EQ(voxels_for(Seconds(0.8), times, 128), 64) << "twice the edge, eight times the voxels";
  EXPECT_EQ(voxels_for(Seconds(0.1), times, 128), 32);
  EXPECT_EQ(voxels_for(Seconds(1000), times, 96), 96);
  EXPECT_FALSE(voxels_for(Seconds(0.001), times, 128)) << "even 16 take longer";
  EXPECT_FALSE(voxels_for(Seconds(1), VolumeTimes(), 128));
}

/// A machine whose volumes take so long at 32 voxels, and as the voxels' number.
double seconds_with(int voxels, double at_32) { return at_32 * std::pow(voxels / 32.0, 3); }

TEST(LiveVoxels, AreChosenOnceWhereTimeGrowsAsTheirNumber) {
  for (const double at_32 : {0.002, 0.05, 0.3, 2.0, 50.0}) {
    LiveVoxels voxels(Seconds(0.5), 128);
    VolumeTimes times;
    int changes = 0;
    for (int volume = 0; volume < 40; ++volume) {
      const double darkness = times.voxels() == voxels.voxels() ? 1 : 3;
      times.add(voxels.voxels(), Seconds(darkness * seconds_with(voxels.voxels(), at_32)));
      changes += voxels.done(times) ? 1 : 0;
    }
    EXPECT_LE(changes, 1) << at_32;
    const bool few = voxels.voxels() == kFewestLiveVoxels;
    if (!few) {
      EXPECT_LE(seconds_with(voxels.voxels(), at_32), 0.5) << at_32;
    }
    if (few || voxels.voxels() == kMostLiveVoxels) continue;
    EXPECT_GT(seconds_with(voxels.voxels() + 8, at_32), 0.5) << at_32 << ": more would be too slow";
  }
}

TEST(LiveVoxels, AreChosenAnewWhenTheMachineIsNeededElsewhere) {
  LiveVoxels voxels(Seconds(0.5), 128);
  VolumeTimes times = times_of(32, {0.1, 0.1});
  ASSERT_TRUE(voxels.done(times));
  const int alone = voxels.voxels();
  times = times_of(alone, {0.9, 2, 2, 2});
  EXPECT_TRUE(voxels.done(times));
  EXPECT_LT(voxels.voxels(), alone);
}

TEST(LiveVoxels, MemoryBoundsThem) {
  const Scene scene = ball_scene({.views = 3, .image = {16, 12}});
  EXPECT_EQ(most_voxels(scene, {}, 1e12), kMostLiveVoxels);
  EXPECT_EQ(most_voxels(scene, {}, 0), kFewestLiveVoxels);
  const int some = most_voxels(scene, {}, 50e6);
  EXPECT_GT(some, kFewestLiveVoxels);
  EXPECT_LT(some, kMostLiveVoxels);
}

TEST(LiveVerdict, SaysWhatWouldHold) {
  const LivePace pace{.every = 6, .rate = Hertz(24)};  // 0.25 s
  const LiveVerdict holds = verdict_of(pace, times_of(64, {0.2}));
  EXPECT_TRUE(holds.keeps_up);
  const LiveVerdict slow = verdict_of(pace, times_of(64, {0.5}));
  EXPECT_FALSE(slow.keeps_up);
  EXPECT_EQ(slow.holds_every, 12U);
  EXPECT_EQ(slow.holds_voxels, 48) << "64 / 2^(1/3) = 50.8, in steps of 8";
  EXPECT_TRUE(verdict_of({.every = slow.holds_every, .rate = Hertz(24)}, times_of(64, {0.5})).keeps_up);
  EXPECT_TRUE(verdict_of({.every = 0, .rate = Hertz(24)}, times_of(64, {5})).keeps_up)
      << "no frame was asked for by its number";
  EXPECT_EQ(verdict_of(pace, VolumeTimes()).holds_every, 0U);
}

}  // namespace
}  // namespace emberlock::recon
