// SPDX-License-Identifier: Apache-2.0
// The configured rig: which clock it runs on, what it does while cameras are away, and what it shows.
#include "rig/devices/rig.h"

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rig/align/alignment.h"
#include "rig/align/record.h"
#include "tests/support/recording.h"
#include "tests/support/small_rig.h"
#include "tests/support/socket_cameras.h"
#include "tests/support/wait.h"

namespace emberlock::rig {
namespace {

using Thread = drivers::CameraThread::State;
using test::kHangGuard;
using test::wait_until;
using testing::ElementsAre;
using testing::HasSubstr;

CameraConfig virtual_cameras(int count, ImageSize size = {320, 240}) {
  CameraConfig config;
  config.count = count;
  config.request.size = size;
  return config;
}

RigConfig fast_rig(int cameras) {
  RigConfig config;
  config.cameras = {virtual_cameras(cameras)};
  config.virtual_rig.time = VirtualConfig::Time::fast;
  config.strobe.source = StrobeSource::virtual_;
  return config;
}

TEST(RigThreads, OneRigsStrobeLightsTheOthers) {
  const test::TempFolder folder;
  RigConfig config;
  config.cameras = {virtual_cameras(1)};
  config.virtual_rig.light = folder / "light.txt";
  const auto follower = Rig::open(config);
  config.strobe.source = StrobeSource::virtual_;
  const auto leader = Rig::open(config);
  ASSERT_TRUE(follower.ok() && leader.ok());
  // Of the frames that are read within ten seconds.
  const auto dots = [](Rig& rig) {
    std::size_t count = 0;
    for (std::uint64_t frame = 0; frame < 240; ++frame) count += rig.virtual_rig()->dots(0, frame).size();
    return count;
  };
  ASSERT_TRUE((*follower)->virtual_rig()->camera(0).start().ok());
  EXPECT_EQ(dots(**follower), 0U);
  ASSERT_TRUE((*leader)
                  ->virtual_rig()
                  ->strobe()
                  .apply({.output = drivers::StrobeOutput::flashing, .rate = Hertz(100)})
                  .ok());
  EXPECT_GT(dots(**follower), 10U);
}

TEST(RigThreads, FastVirtualCamerasAlignOnTheirOwnClock) {
  RigConfig config = fast_rig(3);
  auto rig = Rig::open(config);
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  EXPECT_EQ((*rig)->pace(), Rig::Pace::fast);
  EXPECT_EQ((*rig)->driver(0), "virtual");
  EXPECT_EQ((*rig)->state(0), Thread::idle);
  AlignmentConfig alignment;
  alignment.run.hold.reset();
  alignment.tolerance = smear::Tolerance{Rows(30)};
  alignment.reference = "virtual-02";
  const auto options = (*rig)->align_options(alignment);
  ASSERT_TRUE(options.ok()) << options.error().message();
  EXPECT_EQ(options->align.reference, 2U);
  const auto result = run_align((*rig)->devices(), *options);
  ASSERT_TRUE(result.ok()) << result.error().message();
  EXPECT_EQ(result->last.verdict, smear::AlignVerdict::aligned) << result->words.reason;
  EXPECT_EQ((*rig)->state(0), Thread::filming);
  EXPECT_GT((*rig)->clock().now().ns, 0);
}

TEST(RigThreads, IsTheSameEachTimeWhenItIsFast) {
  const auto stamps = [] {
    auto rig = Rig::open(fast_rig(2)).value();
    std::vector<std::int64_t> all;
    for (std::size_t i = 0; i < rig->size(); ++i) EXPECT_TRUE(rig->camera(i).start().ok());
    for (int k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < rig->size(); ++i)
        all.push_back(rig->camera(i).next_frame(Seconds(1))->stamp.monotonic_time.ns);
    }
    return all;
  };
  EXPECT_EQ(stamps(), stamps());
}

TEST(RigThreads, CamerasOfSeveralBlocksKeepTheirOrderAndDifferInTruth) {
  RigConfig config = fast_rig(2);
  CameraConfig other = virtual_cameras(1, {160, 120});
  other.id = "left one";
  other.reset = ShutterReset::by_hand;
  other.direction = smear::ReadDirection::bottom_first;
  config.cameras.push_back(other);
  auto rig = Rig::open(config);
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  ASSERT_EQ((*rig)->size(), 3U);
  std::vector<std::string> ids;
  for (std::size_t i = 0; i < 3; ++i) ids.push_back((*rig)->camera(i).info().id);
  EXPECT_THAT(ids, ElementsAre("virtual-00", "virtual-01", "left one"));
  EXPECT_EQ((*rig)->camera(2).info().reset, ShutterReset::by_hand);
  const auto timing = (*rig)->timing();
  EXPECT_EQ(timing[0].rows, 240);
  EXPECT_EQ(timing[2].rows, 120);
  EXPECT_EQ(timing[2].direction, smear::ReadDirection::bottom_first);
  const drivers::VirtualRig& truth = *(*rig)->virtual_rig();
  EXPECT_NE(truth.truth(0).timing.frame_period, truth.truth(1).timing.frame_period);
  // The read phase fills the frame period whatever the picture's height.
  for (int i = 0; i < 3; ++i) {
    const smear::CcdTiming& t = truth.truth(i).timing;
    EXPECT_GT(t.shifts * t.row_time.value() / t.frame_period.value(), 0.9) << i;
  }
}

TEST(RigThreads, WhatCantBeTogetherIsRefused) {
  const auto refusal = [](const RigConfig& config) {
    const auto rig = Rig::open(config);
    return rig.ok() ? std::string() : rig.error().message();
  };
  RigConfig none;
  EXPECT_THAT(refusal(none), HasSubstr("there is no camera"));
  RigConfig hurried = fast_rig(1);
  CameraConfig real;
  real.source = CameraSource::v4l2;
  real.id = "c1";
  hurried.cameras.push_back(real);
  EXPECT_THAT(refusal(hurried), HasSubstr("only virtual devices run faster"));
  RigConfig recorded_strobe = fast_rig(1);
  recorded_strobe.strobe.source = StrobeSource::replay;
  EXPECT_THAT(refusal(recorded_strobe), HasSubstr("a recorded strobe lights no live camera"));
  RigConfig unlit;
  unlit.cameras = {real};
  unlit.strobe.source = StrobeSource::virtual_;
  EXPECT_THAT(refusal(unlit), HasSubstr("a virtual strobe lights virtual cameras alone"));
  AlignmentConfig alignment;
  alignment.reference = "nobody";
  EXPECT_THAT(Rig::open(fast_rig(1)).value()->align_options(alignment).error().message(),
              HasSubstr("there is no camera nobody"));
}

TEST(RigThreads, AStrobeThatIsSetByHandTellsTheAlignmentOfItsDial) {
  RigConfig config = fast_rig(1);
  EXPECT_FALSE(Rig::open(config).value()->align_options({})->align.dial);
  config.strobe.source = StrobeSource::manual;
  config.strobe.dial.step = Hertz(1.0 / 60);
  const auto rig = Rig::open(config).value();
  ASSERT_NE(rig->strobe(), nullptr);
  EXPECT_EQ(rig->strobe()->id(), "manual");
  EXPECT_EQ(rig->align_options({})->align.dial, config.strobe.dial);
  config.strobe.dial.step = Hertz(0);
  EXPECT_FALSE(Rig::open(config).ok());
}

class RigInRealTimeThreads : public testing::Test {
 protected:
  RigInRealTimeThreads() { test::unplug("c1"); }
  static RigConfig config() {
    RigConfig rig;
    rig.cameras = {virtual_cameras(2, {64, 48})};
    CameraConfig real;
    real.source = CameraSource::v4l2;
    real.id = "c1";
    real.reset = ShutterReset::by_hand;
    rig.cameras.push_back(real);
    rig.strobe.source = StrobeSource::virtual_;
    return rig;
  }
  std::vector<drivers::CameraDriver> drivers = test::socket_drivers();
  RigOptions options{.drivers = drivers};
};

TEST_F(RigInRealTimeThreads, ACameraThatIsAbsentAtStartIsLostUntilItComes) {
  auto rig = Rig::open(config(), options);
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  EXPECT_EQ((*rig)->pace(), Rig::Pace::real_time);
  drivers::Camera& late = (*rig)->camera(2);
  EXPECT_EQ(late.info().layout.size, (ImageSize{0, 0})) << "not known yet";
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE((*rig)->camera(i).start().ok()) << i;
  EXPECT_EQ((*rig)->state(0), Thread::filming);
  EXPECT_EQ((*rig)->state(2), Thread::lost);
  ASSERT_TRUE((*rig)->trouble(2));
  EXPECT_THAT((*rig)->trouble(2)->message(), HasSubstr("there is no such camera"));
  EXPECT_EQ(late.next_frame(Seconds(0)).error().kind, ErrorKind::device) << "said once";
  EXPECT_EQ(late.next_frame(Seconds(0)).error().kind, ErrorKind::timed_out);
  EXPECT_TRUE((*rig)->camera(0).next_frame(kHangGuard).ok()) << "the others film";

  test::plug_in("c1");
  const auto frame = late.next_frame(kHangGuard);
  ASSERT_TRUE(frame.ok()) << frame.error().message();
  EXPECT_EQ((*rig)->state(2), Thread::filming);
  EXPECT_FALSE((*rig)->trouble(2));
  EXPECT_EQ(late.info().layout.size, (ImageSize{64, 48})) << "learnt";
  EXPECT_EQ(late.info().model, "socket camera");
  EXPECT_EQ(late.info().reset, ShutterReset::by_hand) << "configured";
  EXPECT_EQ((*rig)->timing()[2].rows, 48);

  test::unplug("c1");
  EXPECT_TRUE(wait_until([&] { return (*rig)->state(2) == Thread::lost; }));
  test::plug_in("c1");
  EXPECT_TRUE(wait_until([&] { return (*rig)->state(2) == Thread::filming; }));
}

TEST_F(RigInRealTimeThreads, EveryFrameIsShownAlsoThoseThatNobodyTakes) {
  test::plug_in("c1");
  std::array<std::atomic<int>, 3> shown{};
  const auto screen = std::make_shared<int>();
  options.on_frame = [&shown, screen](std::size_t camera, const Frame& frame) {
    if (frame.image) ++shown.at(camera);
  };
  {
    auto rig = Rig::open(config(), options).value();
    for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(rig->camera(i).start().ok());
    EXPECT_TRUE(wait_until([&] { return shown[0] > 3 && shown[1] > 3 && shown[2] > 3; }));
    rig->camera(0).pass_over(rig->clock().now() + Seconds(60));
    const int before = shown[0];
    EXPECT_TRUE(wait_until([&] { return shown[0] > before + 2; })) << "passed over";
  }
  options = {};
  EXPECT_TRUE(wait_until([&] { return screen.use_count() == 1; })) << "a rig that is gone shows nothing";
}

/// An alignment of two virtual cameras, recorded.
class RigOfARecordingThreads : public testing::Test {
 protected:
  RigOfARecordingThreads() {
    test::SmallBench bench(test::small_rig(4, 2));
    EXPECT_TRUE(record_align(folder / "session", bench.align, bench.options).ok());
    CameraConfig recorded;
    recorded.source = CameraSource::replay;
    config.cameras = {recorded};
    config.replay_session = folder / "session";
  }

  const test::TempFolder folder;
  RigConfig config;
};

TEST_F(RigOfARecordingThreads, RunsOnItsOwnClockWhenAllOfItIsRecorded) {
  config.strobe.source = StrobeSource::replay;
  auto rig = Rig::open(config);
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  EXPECT_EQ((*rig)->pace(), Rig::Pace::recorded);
  ASSERT_EQ((*rig)->size(), 2U);
  ASSERT_TRUE((*rig)->camera(0).start().ok());
  EXPECT_EQ((*rig)->state(0), Thread::filming);
  while ((*rig)->camera(0).next_frame(Seconds(1)).ok()) {
  }
  EXPECT_EQ((*rig)->state(0), Thread::ended);
  config.cameras[0].id = "nobody";
  EXPECT_THAT(Rig::open(config).error().message(), HasSubstr("the session has no such camera"));
}

TEST_F(RigOfARecordingThreads, FilmsAtItsOldPaceBesideLiveCameras) {
  config.cameras.push_back(virtual_cameras(1, {64, 48}));
  config.cameras.back().id = "live";
  config.strobe.source = StrobeSource::virtual_;
  auto rig = Rig::open(config);
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  ASSERT_EQ((*rig)->size(), 3U);
  EXPECT_EQ((*rig)->pace(), Rig::Pace::real_time);
  const TimePoint began = (*rig)->clock().now();
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE((*rig)->camera(i).start().ok());
  const auto first = (*rig)->camera(0).next_frame(kHangGuard);
  auto last = first;
  for (int i = 0; i < 6; ++i) last = (*rig)->camera(0).next_frame(kHangGuard);
  ASSERT_TRUE(first.ok() && last.ok());
  const Seconds period(1 / 23.976);
  EXPECT_NEAR((last->stamp.monotonic_time - first->stamp.monotonic_time).value(), 6 * period.value(), 1e-3);
  EXPECT_GE((*rig)->clock().now() - began, 5 * period) << "it takes as long as then";
  EXPECT_GE((*rig)->clock().now(), last->stamp.monotonic_time) << "not before its time";
  EXPECT_FALSE((*rig)->camera(0).reset_shutter(began).ok());
}

}  // namespace
}  // namespace emberlock::rig
