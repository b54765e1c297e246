// SPDX-License-Identifier: Apache-2.0
// The rig's time, queues, resets, names and options.
#include "drivers/virtual/virtual_rig.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <sstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>

#include "base/log.h"
#include "tests/support/virtual_cameras.h"
#include "tests/support/wait.h"

namespace emberlock::drivers {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)
using test::kHangGuard;
using test::wait_until;
using testing::HasSubstr;

std::vector<VirtualCameraOptions> cameras(int count) {
  std::vector<VirtualCameraOptions> all(count, small_camera());
  for (int i = 0; i < count; ++i) {
    all[i].id = "camera-" + std::to_string(i);
    all[i].first_phase.reset();
  }
  return all;
}

TEST(VirtualRigThreads, FramesComeAtTheEndOfTheirReadPhase) {
  const auto rig = small_rig({small_camera()}, {});
  ASSERT_TRUE(rig->camera(0).start().ok());
  for (std::uint64_t id = 0; id < 5; ++id) {
    const Frame f = rig->camera(0).next_frame(Seconds(1)).value();
    EXPECT_EQ(f.stamp.frame_id, id);
    EXPECT_EQ(f.stamp.monotonic_time, rig->clock().now());
    EXPECT_NEAR(in_milliseconds(f.stamp.monotonic_time - rig->read_start(0, id)), 30, 1e-5);  // K t_row
    // The first image after the start is kept back.
    EXPECT_NEAR((rig->read_start(0, id) - TimePoint{}).value(), (static_cast<double>(id) + 1) / 24, 1e-9);
  }
}

/// What the drivers log while it lives.
class DriversLog {
 public:
  DriversLog() { log(LogCategory::drivers).sinks().push_back(sink_); }
  ~DriversLog() { log(LogCategory::drivers).sinks().pop_back(); }
  DriversLog(const DriversLog&) = delete;
  DriversLog& operator=(const DriversLog&) = delete;
  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  std::shared_ptr<spdlog::sinks::sink> sink_ = std::make_shared<spdlog::sinks::ostream_sink_mt>(text_);
};

TEST(VirtualRigThreads, FramesThatAreHeldBackComeLaterAndShowTheSame) {
  VirtualCameraOptions camera = small_camera();
  const auto at_once = small_rig({camera}, {Pass::lamp});
  camera.transport = milliseconds(125);
  const auto held = small_rig({camera}, {Pass::lamp});
  EXPECT_EQ(held->camera(0).info().transport, milliseconds(125));
  for (const auto& rig : {at_once.get(), held.get()}) ASSERT_TRUE(rig->camera(0).start().ok());
  for (int i = 0; i < 3; ++i) {
    const Frame a = at_once->camera(0).next_frame(Seconds(1)).value();
    const Frame b = held->camera(0).next_frame(Seconds(1)).value();
    EXPECT_EQ(a.stamp.frame_id, b.stamp.frame_id);
    EXPECT_EQ(b.stamp.monotonic_time - a.stamp.monotonic_time, milliseconds(125));
    EXPECT_EQ(a.image->bytes().size(), b.image->bytes().size());
    EXPECT_TRUE(std::equal(a.image->bytes().begin(), a.image->bytes().end(), b.image->bytes().begin()));
  }
  EXPECT_EQ(held->camera(0).pass_over(held->clock().now()), 0U) << "what hasn't come can't be passed over";
}

TEST(VirtualRigThreads, FramesThatAreLostAreCountedWithoutALineOfTheJournalEach) {
  const DriversLog said;
  const auto rig = small_rig({small_camera()}, {});
  ASSERT_TRUE(rig->camera(0).start().ok());
  rig->clock().sleep_until(rig->clock().now() + Seconds(100));
  EXPECT_GT(rig->camera(0).next_frame(Seconds(1)).value().stamp.frame_id, 1000U);
  EXPECT_GT(rig->camera(0).counts().queue, 1000U);
  EXPECT_EQ(said.text(), "");
}

TEST(VirtualRigThreads, FramesThatArePassedOverAreCountedAndNotLost) {
  const DriversLog said;
  const auto rig = small_rig({small_camera()}, {});
  Camera& camera = rig->camera(0);
  EXPECT_EQ(camera.pass_over(rig->clock().now()), 0U) << "it doesn't film";
  ASSERT_TRUE(camera.start().ok());
  const std::uint64_t before = camera.next_frame(Seconds(1)).value().stamp.frame_id;
  const TimePoint until = rig->clock().now() + Seconds(100);
  rig->clock().sleep_until(until);
  const std::uint64_t passed = camera.pass_over(until);
  EXPECT_EQ(camera.pass_over(until), 0U);
  const Frame next = camera.next_frame(Seconds(1)).value();
  EXPECT_GE(next.stamp.monotonic_time, until);
  EXPECT_EQ(next.stamp.frame_id, before + passed + 1);
  EXPECT_EQ(said.text(), "");
}

TEST(VirtualRigThreads, AShortDeadlineTimesOutAndLosesNothing) {
  const auto rig = small_rig({small_camera()}, {});
  ASSERT_TRUE(rig->camera(0).start().ok());
  const auto late = rig->camera(0).next_frame(milliseconds(10));
  ASSERT_FALSE(late.ok());
  EXPECT_EQ(late.error().kind, ErrorKind::timed_out);
  EXPECT_EQ(rig->clock().now().ns, 10'000'000);
  EXPECT_EQ(rig->camera(0).next_frame(Seconds(1)).value().stamp.frame_id, 0U);
  for (const double odd : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_EQ(rig->camera(0).next_frame(Seconds(odd)).error().kind, ErrorKind::timed_out);
  }
  EXPECT_TRUE(rig->camera(0).next_frame(Seconds(std::numeric_limits<double>::infinity())).ok());
}

TEST(VirtualRigThreads, ACameraThatDoesNotFilmSaysSo) {
  const auto rig = small_rig({small_camera()}, {});
  EXPECT_EQ(rig->camera(0).next_frame(Seconds(1)).error().kind, ErrorKind::device);
  EXPECT_EQ(rig->camera(0).reset_shutter({}).error().kind, ErrorKind::device);
  ASSERT_TRUE(rig->camera(0).start().ok());
  rig->camera(0).stop();
  rig->camera(0).stop();
  EXPECT_EQ(rig->camera(0).next_frame(Seconds(1)).error().kind, ErrorKind::device);
}

TEST(VirtualRigThreads, CamerasUsedOneAfterTheOtherKeepTheirFramesInOrder) {
  const auto rig = small_rig(cameras(3), {});
  for (int c = 0; c < 3; ++c) ASSERT_TRUE(rig->camera(c).start().ok());
  TimePoint last;
  for (int c = 0; c < 3; ++c) {
    for (std::uint64_t id = 0; id < 30; ++id) {
      const Frame f = rig->camera(c).next_frame(Seconds(1)).value();
      ASSERT_EQ(f.stamp.frame_id, id) << "camera " << c;
      if (c == 0) last = f.stamp.monotonic_time;
    }
  }
  EXPECT_LT((rig->clock().now() - last).value(), 1.1 / 24);  // the others had their frames waiting
}

TEST(VirtualRigThreads, AQueueThatOverflowsShowsAsAGap) {
  const auto rig = small_rig(cameras(2), {});
  for (int c = 0; c < 2; ++c) ASSERT_TRUE(rig->camera(c).start().ok());
  ASSERT_EQ(rig->camera(1).next_frame(Seconds(1)).value().stamp.frame_id, 0U);
  for (int i = 0; i < 200; ++i) ASSERT_TRUE(rig->camera(0).next_frame(Seconds(1)).ok());
  const auto first = rig->camera(1).next_frame(Seconds(1)).value().stamp.frame_id;
  EXPECT_NEAR(static_cast<double>(first), 200 - 64, 1.5);
  for (std::uint64_t i = 1; i < 64; ++i) {
    EXPECT_EQ(rig->camera(1).next_frame(Seconds(0)).value().stamp.frame_id, first + i);
  }
  EXPECT_EQ(rig->camera(1).next_frame(Seconds(0)).error().kind, ErrorKind::timed_out);
}

TEST(VirtualRigThreads, TheSameSeedGivesTheSameFramesInAnyOrder) {
  const std::vector<Pass> all = {Pass::lamp,       Pass::bloom,      Pass::smear,   Pass::hot_pixels,
                                 Pass::shot_noise, Pass::read_noise, Pass::quantise};
  const auto film = [&](bool camera_by_camera) {
    const auto rig = small_rig(cameras(2), all);
    EXPECT_TRUE(rig->strobe().apply({.output = StrobeOutput::flashing, .rate = Hertz(24.3)}).ok());
    std::vector<Frame> frames(20);
    for (int c = 0; c < 2; ++c) EXPECT_TRUE(rig->camera(c).start().ok());
    for (int i = 0; i < 20; ++i) {
      const int c = camera_by_camera ? i / 10 : i % 2;
      const int place = camera_by_camera ? i : i / 2 + 10 * (i % 2);
      frames[place] = rig->camera(c).next_frame(Seconds(1)).value();
    }
    return frames;
  };
  const auto a = film(true);
  const auto b = film(false);
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(a[i].stamp, b[i].stamp);
    EXPECT_EQ(*a[i].image, *b[i].image);
  }
  EXPECT_NE(*a[0].image, *a[10].image);
  EXPECT_NE(*a[0].image, *a[1].image);
}

TEST(VirtualRigThreads, AnotherSeedDrawsOtherPhasesAndNoise) {
  const auto a = draw_virtual_rig({.cameras = 2, .seed = 1});
  const auto b = draw_virtual_rig({.cameras = 2, .seed = 2});
  EXPECT_NE(a.cameras[0].lamp.x, b.cameras[0].lamp.x);
  EXPECT_NE(a.cameras[0].timing.frame_period, b.cameras[0].timing.frame_period);
  EXPECT_NE(a.cameras[0].lamp.x, a.cameras[1].lamp.x);
  const auto again = draw_virtual_rig({.cameras = 2, .seed = 1});
  EXPECT_EQ(a.cameras[1].lamp.x, again.cameras[1].lamp.x);
  EXPECT_EQ(a.cameras[1].reset_latency, again.cameras[1].reset_latency);
}

TEST(VirtualRigThreads, AResetByHandDrawsAUniformPhase) {
  VirtualCameraOptions c = small_camera();
  c.reset = ShutterReset::by_hand;
  const auto rig = small_rig({c}, {});
  ASSERT_TRUE(rig->camera(0).start().ok());
  const int n = 2000;
  std::vector<double> phases;
  for (int i = 0; i < n; ++i) {
    ASSERT_TRUE(rig->camera(0).reset_shutter(rig->clock().now()).ok());
    const auto id = rig->camera(0).next_frame(Seconds(5)).value().stamp.frame_id;
    const double t = (rig->read_start(0, id) - TimePoint{}).value();
    phases.push_back(wrap_positive(t, 1.0 / 24) * 24);
  }
  std::sort(phases.begin(), phases.end());
  double worst = 0;  // Kolmogorov and Smirnov; 1.95 / sqrt(n) is exceeded once in a thousand
  for (int i = 0; i < n; ++i) worst = std::max(worst, std::abs(phases[i] - (i + 0.5) / n));
  EXPECT_LT(worst, 1.95 / std::sqrt(n));
}

TEST(VirtualRigThreads, ATimedResetLandsWithinItsLatencyAndJitter) {
  const auto rig = small_rig({small_camera()}, {});
  ASSERT_TRUE(rig->camera(0).start().ok());
  double squares = 0;
  const int n = 500;
  for (int i = 0; i < n; ++i) {
    const TimePoint at = rig->clock().now() + Seconds(0.5);
    ASSERT_TRUE(rig->camera(0).reset_shutter(at).ok());
    const Frame f = rig->camera(0).next_frame(Seconds(5)).value();
    // The image of the cycle's first read phase is kept back.
    const Seconds first = rig->read_start(0, f.stamp.frame_id) - Seconds(1.0 / 24) - at;
    const double off = in_milliseconds(first) - 180;
    EXPECT_LT(std::abs(off), 1.2);
    squares += off * off;
  }
  EXPECT_NEAR(std::sqrt(squares / n), 0.2, 0.03);
}

TEST(VirtualRigThreads, FramesBeforeAResetAreDroppedAndCounted) {
  const auto rig = small_rig({small_camera()}, {});
  ASSERT_TRUE(rig->camera(0).start().ok());
  ASSERT_EQ(rig->camera(0).next_frame(Seconds(1)).value().stamp.frame_id, 0U);
  rig->clock().sleep_until(rig->clock().now() + Seconds(10.0 / 24));
  const TimePoint at = rig->clock().now();
  ASSERT_TRUE(rig->camera(0).reset_shutter(at).ok());
  const Frame f = rig->camera(0).next_frame(Seconds(1)).value();
  EXPECT_EQ(f.stamp.frame_id, 11U);  // ten were waiting
  EXPECT_GT(f.stamp.monotonic_time, at + Seconds(0.17));
}

TEST(VirtualRigThreads, AResetTakesEffectAtOnceWhenItsMomentHasPassed) {
  const auto rig = small_rig({small_camera()}, {});
  ASSERT_TRUE(rig->camera(0).start().ok());
  rig->clock().sleep_until({1'000'000'000});
  ASSERT_TRUE(rig->camera(0).reset_shutter({5}).ok());
  const Frame f = rig->camera(0).next_frame(Seconds(1)).value();
  EXPECT_GT(rig->read_start(0, f.stamp.frame_id), (TimePoint{1'170'000'000}));
}

VirtualCameraOptions trimmable_camera() {
  VirtualCameraOptions c = small_camera();
  c.trim = FrameRateTrim{PartsPerMillion(100), PartsPerMillion(0.5), milliseconds(80)};
  return c;
}

TEST(VirtualRigThreads, ATrimmedCameraReadsEarlierAndLosesNoFrame) {
  const auto rig = small_rig({trimmable_camera()}, {});
  Camera& camera = rig->camera(0);
  ASSERT_TRUE(camera.start().ok());
  ASSERT_EQ(camera.next_frame(Seconds(1)).value().stamp.frame_id, 0U);
  const TimePoint told = rig->clock().now();
  ASSERT_TRUE(camera.trim_rate(PartsPerMillion(99.9)).ok());  // rounded to a step: 100
  for (std::uint64_t id = 1; id < 240; ++id)
    ASSERT_EQ(camera.next_frame(Seconds(1)).value().stamp.frame_id, id);
  const Seconds filmed = rig->read_start(0, 239) - rig->read_start(0, 0);
  const Seconds untrimmed(239.0 / 24);
  const Seconds in_force = rig->read_start(0, 239) - told - milliseconds(80);
  // Half a frame of the latency is chance.
  EXPECT_NEAR(in_microseconds(untrimmed - filmed), 100 * in_force.value(), 100 * 0.6 / 24);
}

TEST(VirtualRigThreads, ATrimOutlastsAReset) {
  const auto rig = small_rig({trimmable_camera()}, {});
  Camera& camera = rig->camera(0);
  ASSERT_TRUE(camera.start().ok());
  ASSERT_TRUE(camera.trim_rate(PartsPerMillion(-50)).ok());
  ASSERT_TRUE(camera.reset_shutter(rig->clock().now() + Seconds(1)).ok());
  const std::uint64_t first = camera.next_frame(Seconds(5)).value().stamp.frame_id;
  const Seconds period = (rig->read_start(0, first + 100) - rig->read_start(0, first)) / 100;
  EXPECT_NEAR((period * 24 / Seconds(1) - 1) * 1e6, 50, 0.01);
}

TEST(VirtualRigThreads, ATrimOutOfRangeOrOfACameraWithoutOneIsRefused) {
  const auto rig = small_rig({trimmable_camera()}, {});
  EXPECT_EQ(rig->camera(0).trim_rate(PartsPerMillion(101)).error().kind, ErrorKind::device);
  EXPECT_EQ(rig->camera(0).trim_rate(PartsPerMillion(std::nan(""))).error().kind, ErrorKind::device);
  const auto plain = small_rig({small_camera()}, {});
  EXPECT_FALSE(plain->camera(0).info().trim);
  EXPECT_EQ(plain->camera(0).trim_rate(PartsPerMillion(1)).error().kind, ErrorKind::device);
}

TEST(VirtualRigThreads, WhoResetsTheShutterCanBeChangedOrForbidden) {
  const auto rig = small_rig({small_camera()}, {});
  EXPECT_EQ(rig->camera(0).info().reset, ShutterReset::on_command);
  ASSERT_TRUE(rig->camera(0).start().ok());
  rig->set_reset(ShutterReset::none);
  EXPECT_EQ(rig->camera(0).info().reset, ShutterReset::none);
  const Status status = rig->camera(0).reset_shutter({});
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::device);
}

TEST(VirtualRigThreads, TheDevicesClockCountsNominalFrames) {
  VirtualCameraOptions c = small_camera();
  c.timing.frame_period = Seconds(1.0001 / 24);
  const auto rig = small_rig({c}, {});
  ASSERT_TRUE(rig->camera(0).start().ok());
  const Frame a = rig->camera(0).next_frame(Seconds(1)).value();
  for (int i = 0; i < 238; ++i) ASSERT_TRUE(rig->camera(0).next_frame(Seconds(1)).ok());
  const Frame b = rig->camera(0).next_frame(Seconds(1)).value();
  EXPECT_NEAR((b.stamp.device_time - a.stamp.device_time).value(), 239.0 / 24, 1e-8);
  EXPECT_NEAR((b.stamp.monotonic_time - a.stamp.monotonic_time).value(), 239 * 1.0001 / 24, 1e-8);
  EXPECT_EQ(b.stamp.system_time - a.stamp.system_time, b.stamp.monotonic_time - a.stamp.monotonic_time);
}

TEST(VirtualRigThreads, ASceneChangesWithTheNextReadPhase) {
  const auto rig = small_rig({small_camera()}, {});
  ASSERT_TRUE(rig->camera(0).start().ok());
  rig->clock().sleep_until(rig->read_start_after(0, {500'000'000}) + milliseconds(1));
  VirtualScene bright;
  bright.background = 100;
  ASSERT_TRUE(rig->set_scene(bright).ok());
  const TimePoint changed = rig->clock().now();
  for (int i = 0; i < 30; ++i) {
    const Frame f = rig->camera(0).next_frame(Seconds(1)).value();
    const bool after = rig->read_start(0, f.stamp.frame_id) >= changed;
    EXPECT_EQ(f.image->view().sample(3, 3) > 1000, after);
  }
}

/// Cameras that film 200 frames a second.
std::vector<VirtualCameraOptions> fast_cameras(int count) {
  std::vector<VirtualCameraOptions> all = cameras(count);
  for (VirtualCameraOptions& c : all) {
    c.timing.frame_period = milliseconds(5);
    c.timing.row_time = microseconds_per_row(30);
    c.nominal_rate = Hertz(200);
    c.reset_latency = milliseconds(2);
  }
  return all;
}

TEST(VirtualRigThreads, RunsInRealTimeWithASteadyClock) {
  const auto clock = std::make_shared<SteadyClock>();
  const auto rig = small_rig(fast_cameras(1), {Pass::read_noise}, clock);
  const TimePoint begin = clock->now();
  ASSERT_TRUE(rig->camera(0).start().ok());
  for (std::uint64_t id = 0; id < 10; ++id) {
    const auto frame = rig->camera(0).next_frame(kHangGuard);
    ASSERT_TRUE(frame.ok());
    EXPECT_GE(clock->now(), frame->stamp.monotonic_time);
  }
  EXPECT_GT(clock->now() - begin, milliseconds(45));
}

TEST(VirtualRigThreads, EachCameraMayHaveAThreadOfItsOwn) {
  const auto rig = small_rig(fast_cameras(3), {Pass::lamp, Pass::smear, Pass::read_noise},
                             std::make_shared<SteadyClock>());
  std::atomic<int> taken = 0;
  std::vector<std::thread> threads;
  threads.reserve(static_cast<std::size_t>(rig->size()));
  for (int c = 0; c < rig->size(); ++c) {
    threads.emplace_back([&, c] {
      ASSERT_TRUE(rig->camera(c).start().ok());
      for (int i = 0; i < 20; ++i) {
        EXPECT_TRUE(rig->camera(c).next_frame(kHangGuard).ok());
        ++taken;
        if (i % 5 == 4) {
          EXPECT_TRUE(rig->camera(c).reset_shutter({}).ok());
        }
      }
    });
  }
  for (int i = 0; i < 50; ++i) {
    EXPECT_TRUE(rig->strobe().apply({.output = StrobeOutput::flashing, .rate = Hertz(100 + i)}).ok());
    VirtualScene scene = smear_scene();
    scene.background = i;
    EXPECT_TRUE(rig->set_scene(scene).ok());
    EXPECT_TRUE(wait_until([&] { return taken > i; })) << "each scene lights a frame";
  }
  for (std::thread& t : threads) t.join();
}

TEST(VirtualRigName, ElevenCamerasByDefault) {
  const auto options = parse_virtual_rig("virtual:11", 7);
  ASSERT_TRUE(options.ok());
  EXPECT_EQ(options->seed, 7U);
  ASSERT_EQ(options->cameras.size(), 11U);
  EXPECT_EQ(options->cameras[3].id, "virtual-03");
  for (const VirtualCameraOptions& c : options->cameras) {
    EXPECT_EQ(c.layout, (ImageLayout{.size = {1280, 720}}));
    EXPECT_EQ(c.timing.rows, 720);
    EXPECT_EQ(c.timing.shifts, 740);
    EXPECT_NEAR((c.timing.frame_period / period(Hertz(23.976)) - 1) * 1e6, 0, 20);
    EXPECT_GE(c.lamp.y, Rows(200));
    EXPECT_LE(c.lamp.y, Rows(520));
  }
  EXPECT_TRUE(VirtualRig::create(*options, std::make_shared<VirtualClock>()).ok());
}

TEST(VirtualRigName, NonsenseIsRefusedWithAnExample) {
  for (const char* name : {"virtual:0", "virtual:x", "virtual:65", "virtual:", "virtual", "", "virtual:-1",
                           "virtual:1x", "virtual:99999999999999999999", "replay:1"}) {
    const auto options = parse_virtual_rig(name);
    ASSERT_FALSE(options.ok()) << name;
    EXPECT_EQ(options.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(options.error().message(), HasSubstr("virtual:11"));
  }
}

TEST(VirtualRigOptions, MixedModelsDrawEveryDirectionAndReadLength) {
  const auto rig = draw_virtual_rig({.cameras = 40, .models = VirtualRigDraw::Models::mixed});
  int up = 0, plain = 0, dummies = 0, full = 0;
  for (const VirtualCameraOptions& c : rig.cameras) {
    EXPECT_TRUE(check(c.timing).ok());
    up += c.timing.direction == smear::ReadDirection::bottom_first;
    plain += c.timing.shifts == 720, dummies += c.timing.shifts == 740, full += c.timing.shifts == 772;
  }
  EXPECT_GT(up, 8);
  EXPECT_LT(up, 32);
  EXPECT_GT(std::min({plain, dummies, full}), 4);
  EXPECT_EQ(plain + dummies + full, 40);
}

void expect_refused(const VirtualRigOptions& options, const char* words) {
  const auto rig = VirtualRig::create(options, std::make_shared<VirtualClock>());
  ASSERT_FALSE(rig.ok()) << words;
  EXPECT_EQ(rig.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(rig.error().message(), HasSubstr(words));
  EXPECT_FALSE(rig.error().remedy.empty());
}

TEST(VirtualRigOptions, ImpossibleOnesAreRefusedByName) {
  const auto with = [](auto change) {
    VirtualRigOptions o;
    o.cameras = cameras(2);
    change(o);
    return o;
  };
  expect_refused(with([](auto& o) { o.cameras.clear(); }), "number of cameras");
  expect_refused(with([](auto& o) { o.cameras[1].id = o.cameras[0].id; }), "camera-0");
  expect_refused(with([](auto& o) { o.cameras[1].timing.shifts = 100; }), "camera-1");
  expect_refused(with([](auto& o) { o.cameras[1].timing.rows = 100; }), "timing.rows");
  expect_refused(with([](auto& o) { o.cameras[1].lamp.radius = 0; }), "lamp.radius");
  expect_refused(with([](auto& o) { o.cameras[1].layout.bit_depth = 8; }), "bit_depth");
  expect_refused(with([](auto& o) { o.cameras[1].layout.size.width = 0; }), "width");
  expect_refused(with([](auto& o) { o.cameras[1].reset_latency = Seconds(NAN); }), "reset_latency");
  expect_refused(with([](auto& o) { o.queue_frames = 0; }), "queue_frames");
  expect_refused(with([](auto& o) { o.strobe.rate_error = PartsPerMillion(1e6); }), "rate_error");
  expect_refused(with([](auto& o) { o.scene.exposure = Seconds(1); }), "exposure");
  expect_refused(with([](auto& o) { o.scene.read_noise = -1; }), "read_noise");
  expect_refused(with([](auto& o) { o.scene.passes = {Pass::flame}; }), "flame");
}

TEST(VirtualRigOptions, ARefusedSceneChangesNothing) {
  const auto rig = small_rig({small_camera()}, {});
  ASSERT_TRUE(rig->camera(0).start().ok());
  VirtualScene scene;
  scene.background = 300;
  EXPECT_FALSE(rig->set_scene(scene).ok());
  EXPECT_EQ(rig->camera(0).next_frame(Seconds(1)).value().image->view().sample(0, 0), 96);
}

}  // namespace
}  // namespace emberlock::drivers
