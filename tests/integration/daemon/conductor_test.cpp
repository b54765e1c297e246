// SPDX-License-Identifier: Apache-2.0
// The daemon without its servers: from the strobe to a recording, on simulated cameras and a clock of their
// own.
#include "daemon/engine/conductor.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/virtual/virtual_dial.h"
#include "drivers/virtual/virtual_rig.h"
#include "session/reader.h"
#include "tests/support/small_daemon.h"

namespace emberlock {
namespace {

using test::small_config;
using test::SmallDaemon;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class Daemon : public ::testing::Test {
 protected:
  /// The largest true difference between two read phases, modulo the frame period.
  static Seconds true_spread(drivers::VirtualRig& rig) {
    const TimePoint now = rig.clock().now();
    const double period = rig.truth(0).timing.frame_period.value();
    double spread = 0;
    for (int a = 0; a < rig.size(); ++a) {
      for (int b = 0; b < a; ++b) {
        const double apart = (rig.read_start_after(a, now) - rig.read_start_after(b, now)).value();
        spread = std::max(spread, std::abs(std::remainder(apart, period)));
      }
    }
    return Seconds(spread);
  }
  test::TempFolder temp_;
};
using DaemonSlow = Daemon;

TEST_F(Daemon, FromColdToLocked) {
  SmallDaemon daemon(small_config(temp_.path()));
  EXPECT_EQ(daemon.conductor->status().phase(), v1::IDLE);
  ASSERT_TRUE(daemon.conductor->align({}).ok());
  EXPECT_EQ(daemon.conductor->phase(), v1::CALIBRATING);
  ASSERT_TRUE(daemon.reach(v1::ALIGNING));
  ASSERT_TRUE(daemon.reach(v1::LOCKED));
  const v1::DaemonStatus status = daemon.conductor->status();
  const double tolerance = status.alignment().tolerance_s();
  EXPECT_LE(true_spread(*daemon.rig->virtual_rig()).value(), 2 * tolerance);
  EXPECT_EQ(status.light(), v1::GREEN);
  EXPECT_GT(status.alignment().time_left_s(), 0);
  EXPECT_GT(status.alignment().history_size(), 0);
  EXPECT_GT(status.alignment().cost().time_p95_s(), 0);
  EXPECT_THAT(status.cameras(), SizeIs(4));
  const double row_time = daemon.rig->virtual_rig()->truth(0).timing.row_time.value();
  for (const v1::CameraStatus& camera : status.cameras()) {
    EXPECT_LE(std::abs(camera.error_s()), tolerance);
    EXPECT_NEAR(camera.row_time_s() / row_time, 1, 1e-3);
  }
}

TEST_F(Daemon, StaggeredCamerasAreLockedAndTheRecordingTellsTheirPlaces) {
  SmallDaemon daemon(small_config(temp_.path()));
  v1::AlignRequest request;
  request.set_stagger(true);
  ASSERT_TRUE(daemon.locks(request));
  const v1::AlignmentStatus lock = daemon.conductor->status().alignment();
  EXPECT_TRUE(lock.staggered());
  EXPECT_THAT(lock.reason(), HasSubstr("its own instant"));
  ASSERT_TRUE(daemon.record("staggered", 0, false).ok());
  ASSERT_TRUE(daemon.work_until([&] { return daemon.conductor->status().recording().frames() > 8; }));
  ASSERT_TRUE(daemon.conductor->stop_recording().ok());
  ASSERT_TRUE(daemon.reach(v1::LOCKED));
  const auto session = session::SessionReader::open(temp_.path() / "sessions" / "staggered");
  ASSERT_TRUE(session.ok()) << session.error().message();
  drivers::VirtualRig& rig = *daemon.rig->virtual_rig();
  const TimePoint now = rig.clock().now();
  std::vector<double> places;
  for (int i = 0; i < 4; ++i) {
    const v1::CameraStream& stream = session->manifest().cameras(i);
    EXPECT_EQ(stream.late_sigma_s(), lock.tolerance_s());
    places.push_back(4 * stream.late_s() / lock.period_s());
    const double apart = (rig.read_start_after(i, now) - rig.read_start_after(0, now)).value();
    EXPECT_LE(std::abs(std::remainder(apart - stream.late_s(), lock.period_s())), 2 * lock.tolerance_s());
  }
  EXPECT_NEAR(places[0], 0, 1e-9);
  std::sort(places.begin(), places.end());
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(places[static_cast<std::size_t>(i)], i, 1e-9);
}

TEST_F(Daemon, AStrobeThatSomebodySetsByItsDialLocksThemToo) {
  rig::DaemonConfig config = small_config(temp_.path());
  config.rig.strobe.source = rig::StrobeSource::manual;
  config.alignment.run.align.policy = smear::AlignPolicy::timed;
  SmallDaemon daemon(std::move(config));
  v1::DaemonStatus status = daemon.conductor->status();
  EXPECT_TRUE(status.strobe().by_hand());
  EXPECT_THAT(status.strobe().reason(), HasSubstr("is set by hand"));
  v1::StrobeState off;
  off.set_output(v1::StrobeState::OFF);
  EXPECT_EQ(daemon.apply_strobe(off).error().kind, ErrorKind::refused);

  ASSERT_TRUE(daemon.conductor->align({}).ok());
  const auto told = [&](const std::string& words) {
    return daemon.work_until(
        [&] {
          status = daemon.conductor->status();
          return status.strobe().reason().find(words) != std::string::npos;
        },
        100);
  };
  ASSERT_TRUE(
      told("no flash is seen, all through the round: switch the strobe on, and set it to 1438.6 flashes"));
  EXPECT_THAT(status.next_step(), HasSubstr("set it to 1438.6 flashes a minute (23.977 Hz)"));
  EXPECT_EQ(status.strobe().light(), v1::AMBER);
  EXPECT_NEAR(60 * status.strobe().settings().rate_hz(), 1438.6, 0.05);
  EXPECT_EQ(status.strobe().measured_hz(), 0);

  drivers::VirtualDial& dial = *daemon.rig->virtual_rig()->dial();
  dial.turn(Hertz(1400.0 / 60));
  ASSERT_TRUE(told("the strobe flashes at 1400.0 a minute: turn it up by 38.6 (2.76 %), to 1438.6"));
  EXPECT_NEAR(60 * status.strobe().measured_hz(), 1400, 0.5);
  dial.turn(Hertz(1441.5 / 60));
  ASSERT_TRUE(daemon.reach(v1::LOCKED)) << daemon.conductor->status().reason();
  status = daemon.conductor->status();
  EXPECT_EQ(status.strobe().light(), v1::GREEN);
  EXPECT_THAT(status.strobe().reason(), HasSubstr("leave it"));
  EXPECT_NEAR(60 * status.strobe().measured_hz(), 1441.5, 0.5);
  EXPECT_LE(true_spread(*daemon.rig->virtual_rig()).value(), 2 * status.alignment().tolerance_s());
  EXPECT_TRUE(daemon.conductor->stop_sync().ok());
}

TEST_F(Daemon, SlowCamerasAreLockedToo) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    rig::DaemonConfig config = small_config(temp_ / std::to_string(seed));
    config.rig.cameras[0].request.frame_rate = Hertz(10);
    config.rig.virtual_rig.draw.seed = seed;
    config.alignment.run.comb_frames = 24;
    SmallDaemon daemon(std::move(config));
    ASSERT_TRUE(daemon.locks()) << seed;
    const double tolerance = daemon.conductor->status().alignment().tolerance_s();
    EXPECT_LE(true_spread(*daemon.rig->virtual_rig()).value(), 2 * tolerance);
  }
}

TEST_F(Daemon, PicturesAreToldWhereLampDotAndTargetAre) {
  SmallDaemon daemon(small_config(temp_.path()));
  ASSERT_TRUE(daemon.conductor->align({}).ok());
  int dots = 0;
  ASSERT_TRUE(daemon.work_until([&] {
    const v1::DaemonStatus status = daemon.conductor->status();
    for (const v1::CameraStatus& camera : status.cameras()) {
      if (camera.sight() != "known" || !camera.has_target_row() || !camera.has_lamp()) continue;
      ++dots;
      EXPECT_NEAR(camera.dots(0).x(), camera.lamp().x(), 2);
      EXPECT_NEAR(camera.tolerance_rows(), 30, .01);
      // The dot stands off its target by just the error, unless it is so far out that it wrapped.
      if (std::abs(camera.error_rows()) > 60) continue;
      EXPECT_NEAR(std::abs(camera.dots(0).y() - camera.target_row()), std::abs(camera.error_rows()), 1.5);
    }
    return status.phase() == v1::LOCKED;
  }));
  EXPECT_GE(dots, 3);
}

TEST_F(Daemon, HeldForAnHourItIsNeverOutUnnoticed) {
  SmallDaemon daemon(small_config(temp_.path()));
  ASSERT_TRUE(daemon.locks());
  const TimePoint from = daemon.rig->clock().now();
  // Two cameras may lie a tolerance to either side, each as well as flashes shorter than a row tell: to half
  // a one.
  const v1::AlignmentStatus aligned = daemon.conductor->status().alignment();
  const Seconds allowed = 2 * Seconds(aligned.tolerance_s() + 0.5 * aligned.row_time_s());
  for (int i = 0; i < 2000 && daemon.rig->clock().now() - from < Seconds(3600); ++i) {
    if (daemon.conductor->phase() == v1::LOCKED) {
      ASSERT_LE(true_spread(*daemon.rig->virtual_rig()), allowed) << daemon.conductor->status().reason();
    }
    daemon.conductor->work();
  }
  EXPECT_GE((daemon.rig->clock().now() - from).value(), 3600) << daemon.conductor->status().reason();
  EXPECT_GT(daemon.conductor->status().alignment().checks(), 5);
}

TEST_F(Daemon, ALockedRecordingIsWholeAndTheLockIsCheckedAfterIt) {
  SmallDaemon daemon(small_config(temp_.path()));
  ASSERT_TRUE(daemon.locks());
  ASSERT_TRUE(daemon.record("take 1", 2, false).ok());
  EXPECT_EQ(daemon.conductor->phase(), v1::CAPTURING);
  const v1::StrobeState dark = *daemon.read_strobe();
  EXPECT_THAT(dark.code(), ElementsAre(false));  // its time base goes on
  ASSERT_TRUE(daemon.reach(v1::FINISHING));
  const int rounds = static_cast<int>(daemon.conductor->status().alignment().round());
  ASSERT_TRUE(daemon.reach(v1::LOCKED));
  const v1::RecordingStatus recording = daemon.conductor->status().recording();
  EXPECT_EQ(recording.state(), v1::RecordingStatus::COMPLETE) << recording.verdict();
  EXPECT_THAT(recording.verdict(), HasSubstr("none lost"));
  ASSERT_TRUE(daemon.work_until(
      [&] { return static_cast<int>(daemon.conductor->status().alignment().round()) > rounds; }));
  EXPECT_EQ(daemon.conductor->phase(), v1::LOCKED);

  auto session = session::SessionReader::open(temp_.path() / "sessions" / "take 1");
  ASSERT_TRUE(session.ok()) << session.error().message();
  const auto told = std::find_if(session->events().begin(), session->events().end(),
                                 [](const v1::Event& event) { return event.has_decision(); });
  ASSERT_NE(told, session->events().end()) << "a certificate tells by it how well cameras were in sync";
  ASSERT_EQ(told->decision().cameras_size(), 4);
  EXPECT_EQ(told->decision().worst_pair_s(), recording.spread_s());
  for (std::size_t camera = 0; camera < 4; ++camera) {
    const std::vector<FrameStamp>& stamps = session->stamps(camera);
    EXPECT_NEAR(static_cast<double>(stamps.size()), 2 * 23.976, 1);
    // All end at the same instant, whoever is asked first for its frames.
    EXPECT_LE(abs(stamps.back().monotonic_time - session->stamps(0).back().monotonic_time).value(), 1 / 23.9);
    EXPECT_TRUE(session->read(camera, 0).ok());
  }
}

TEST_F(Daemon, WhatCannotBeDoneNowIsRefusedWithARemedy) {
  SmallDaemon daemon(small_config(temp_.path()));
  v1::RecordRequest request;
  const Status unlocked = daemon.conductor->record(request);
  ASSERT_FALSE(unlocked.ok());
  EXPECT_EQ(unlocked.error().kind, ErrorKind::refused);
  EXPECT_FALSE(unlocked.error().remedy.empty());
  EXPECT_FALSE(daemon.conductor->stop_recording().ok());
  request.set_unlocked(true);
  request.set_name("../outside");
  EXPECT_EQ(daemon.conductor->record(request).error().kind, ErrorKind::bad_input);
  request.set_name("-rf");
  EXPECT_EQ(daemon.conductor->record(request).error().kind, ErrorKind::bad_input);
  request.set_name("take");
  request.set_purpose(std::string(3'900'000, 'x'));
  const Status wordy = daemon.conductor->record(request);
  EXPECT_EQ(wordy.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(wordy.error().where, "field purpose");
  request.clear_purpose();
  ASSERT_TRUE(daemon.conductor->record(request).ok());
  EXPECT_EQ(daemon.conductor->align({}).error().kind, ErrorKind::refused);
  ASSERT_TRUE(daemon.conductor->stop_recording().ok());
  ASSERT_TRUE(daemon.reach(v1::IDLE));
  EXPECT_EQ(daemon.conductor->record(request).error().kind, ErrorKind::bad_input);  // the name is taken
}

TEST_F(Daemon, AWholeRecordingReplaysThroughItBitForBit) {
  {
    SmallDaemon live(small_config(temp_.path()));
    ASSERT_TRUE(live.record("live", 3).ok());
    ASSERT_TRUE(live.reach(v1::IDLE));
  }
  rig::DaemonConfig config = small_config(temp_.path());
  config.rig.cameras.clear();
  rig::CameraConfig replayed;
  replayed.source = rig::CameraSource::replay;
  config.rig.cameras.push_back(replayed);
  config.rig.replay_session = temp_.path() / "sessions" / "live";
  config.rig.strobe.source = rig::StrobeSource::replay;
  SmallDaemon again(config);
  ASSERT_TRUE(again.record("again").ok());
  ASSERT_TRUE(again.reach(v1::IDLE));
  EXPECT_EQ(again.conductor->status().recording().state(), v1::RecordingStatus::COMPLETE)
      << again.conductor->status().recording().verdict();
  auto first = session::SessionReader::open(temp_.path() / "sessions" / "live").value();
  auto second = session::SessionReader::open(temp_.path() / "sessions" / "again").value();
  for (std::size_t camera = 0; camera < 4; ++camera) {
    ASSERT_EQ(first.stamps(camera), second.stamps(camera));
    for (std::size_t i = 0; i < first.stamps(camera).size(); ++i)
      ASSERT_EQ(first.read(camera, i)->image->bytes(), second.read(camera, i)->image->bytes());
  }
}

TEST_F(Daemon, StoppedInMidAlignmentItIsIdleAtOnce) {
  bool stop = false;
  SmallDaemon daemon(small_config(temp_.path()), {}, [&] { return stop; });
  ASSERT_TRUE(daemon.conductor->align({}).ok());
  ASSERT_TRUE(daemon.reach(v1::ALIGNING));
  stop = true;
  daemon.conductor->work();
  EXPECT_EQ(daemon.conductor->phase(), v1::ALIGNING);
  ASSERT_TRUE(daemon.conductor->stop_sync().ok());
  EXPECT_EQ(daemon.conductor->phase(), v1::IDLE);
  EXPECT_EQ(daemon.read_strobe()->output(), v1::StrobeState::OFF);
}

TEST_F(DaemonSlow, TheLockHoldsAsLongAsItIsSaidTo) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    rig::DaemonConfig config = small_config(temp_ / std::to_string(seed));
    config.rig.virtual_rig.draw.seed = seed;
    SmallDaemon daemon(std::move(config));
    ASSERT_TRUE(daemon.locks());
    const v1::DaemonStatus status = daemon.conductor->status();
    const double sure = status.alignment().time_left_s();
    EXPECT_GE(sure, 10) << "a lock is called good when it holds for a take";
    EXPECT_GE(status.alignment().likely_left_s(), sure);
    EXPECT_THAT(status.next_step(), HasSubstr("Record: a take may be "));
    ASSERT_TRUE(daemon.record("", sure - 1, false).ok());
    ASSERT_TRUE(daemon.reach(v1::LOCKED, 100'000));
    EXPECT_EQ(daemon.fault(v1::Fault::LOCK_LOST), nullptr) << seed;
  }
}

TEST_F(DaemonSlow, NoCamerasTrulyLieFartherApartBeforeThePromiseIsOverAndTwiceThatWouldBeTooLong) {
  int too_long_if_doubled = 0;
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    rig::DaemonConfig config = small_config(temp_ / std::to_string(seed));
    config.rig.virtual_rig.draw.seed = seed;
    config.rig.virtual_rig.draw.crystal_spread = PartsPerMillion(60);
    SmallDaemon daemon(std::move(config));
    ASSERT_TRUE(daemon.locks());
    const v1::AlignmentStatus lock = daemon.conductor->status().alignment();
    drivers::VirtualRig& rig = *daemon.rig->virtual_rig();
    const TimePoint locked = rig.clock().now();
    // Nothing is reset during a recording.
    ASSERT_TRUE(daemon.record("", 2 * lock.time_left_s()).ok());
    std::optional<Seconds> left;
    ASSERT_TRUE(daemon.work_until(
        [&] {
          if (!left && true_spread(rig).value() > 2 * lock.tolerance_s()) left = rig.clock().now() - locked;
          return daemon.conductor->phase() != v1::CAPTURING;
        },
        100'000));
    if (!left) continue;
    EXPECT_GE(left->value(), lock.time_left_s()) << seed;
    ++too_long_if_doubled;
  }
  EXPECT_GT(too_long_if_doubled, 0) << "this finds nothing";
}

TEST_F(Daemon, ATakeThatIsLongerThanTheLockIsRefusedUntilTheLockIsRenewedForIt) {
  rig::DaemonConfig config = small_config(temp_.path());
  config.rig.virtual_rig.draw.crystal_spread = PartsPerMillion(60);
  SmallDaemon daemon(std::move(config));
  ASSERT_TRUE(daemon.locks());
  // Until the drifts have used up most of it.
  ASSERT_TRUE(daemon.work_until([&] {
    const v1::DaemonStatus status = daemon.conductor->status();
    return status.phase() == v1::LOCKED && status.alignment().has_renewed_left_s() &&
           status.alignment().time_left_s() < 0.4 * status.alignment().renewed_left_s();
  }));
  const v1::AlignmentStatus lock = daemon.conductor->status().alignment();
  v1::RecordRequest request;
  request.set_seconds(0.6 * lock.renewed_left_s());
  const Status refused = daemon.conductor->record(request);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::refused);
  EXPECT_THAT(refused.error().message(), HasSubstr("the lock surely holds for"));
  EXPECT_THAT(refused.error().message(), HasSubstr("enew the lock first"));
  EXPECT_EQ(daemon.conductor->phase(), v1::LOCKED);
  v1::AlignRequest renew;
  renew.set_renew(true);
  renew.set_hold_s(request.seconds());
  ASSERT_TRUE(daemon.conductor->align(renew).ok());
  EXPECT_EQ(daemon.conductor->phase(), v1::ALIGNING);
  ASSERT_TRUE(daemon.reach(v1::LOCKED)) << daemon.conductor->status().reason();
  EXPECT_GE(daemon.conductor->status().alignment().time_left_s(), request.seconds());
  EXPECT_TRUE(daemon.conductor->record(request).ok());
  EXPECT_EQ(daemon.fault(v1::Fault::LOCK_LOST), nullptr);
  ASSERT_TRUE(daemon.conductor->stop_recording().ok());
}

TEST_F(Daemon, TheToleranceFollowsFromTheFlameAndIsRememberedWhenItIsTold) {
  rig::DaemonConfig config = small_config(temp_.path());
  config.alignment.tolerance.reset();
  SmallDaemon daemon(std::move(config));
  v1::AlignRequest request;
  ASSERT_TRUE(daemon.conductor->align(request).ok());
  v1::AlignmentStatus status = daemon.conductor->status().alignment();
  EXPECT_NEAR(status.tolerance_s(), 0.5e-3, 1e-9);
  EXPECT_EQ(status.flame_speed_m_s(), 2);
  request.set_flame_speed_m_s(0.5);
  ASSERT_TRUE(daemon.conductor->align(request).ok());
  ASSERT_TRUE(daemon.conductor->align({}).ok());
  status = daemon.conductor->status().alignment();
  EXPECT_NEAR(status.tolerance_s(), 2e-3, 1e-9);
  EXPECT_NEAR(status.tolerance_rows(), 2e-3 / status.row_time_s(), 1e-6);
  request.Clear();
  request.set_tolerance("30rows");
  ASSERT_TRUE(daemon.conductor->align(request).ok());
  status = daemon.conductor->status().alignment();
  EXPECT_EQ(status.tolerance_rows(), 30);
  EXPECT_EQ(status.flame_speed_m_s(), 0);
  request.set_tolerance("");
  request.set_detail_m(-1);
  EXPECT_EQ(daemon.conductor->align(request).error().kind, ErrorKind::bad_input);
}

/// A flame that is simulated, and a strobe.
class DaemonAtTheFlame : public Daemon {
 protected:
  rig::DaemonConfig config() {
    rig::DaemonConfig config = small_config(temp_.path());
    config.rig.virtual_rig.scene = rig::VirtualConfig::Scene::flame;
    return config;
  }
  /// Pixels of a camera's next frame that are bright, and saturated.
  struct Light {
    int bright = 0, saturated = 0;
  };
  static Light seen(const Image& image) {
    Light light;
    for (const std::byte pixel : image.bytes()) {
      light.bright += std::to_integer<int>(pixel) > 60 ? 1 : 0;
      light.saturated += std::to_integer<int>(pixel) == 255 ? 1 : 0;
    }
    return light;
  }
  Light recorded(const std::string& name) {
    auto session = session::SessionReader::open(temp_.path() / "sessions" / name).value();
    return seen(*session.read(0, session.stamps(0).size() / 2)->image);
  }
  void record(SmallDaemon& daemon, const std::string& name, const std::string& purpose) {
    v1::RecordRequest request;
    request.set_name(name);
    request.set_purpose(purpose);
    request.set_seconds(0.5);
    request.set_unlocked(true);
    const v1::Phase before = daemon.conductor->phase();
    ASSERT_TRUE(daemon.conductor->record(request).ok());
    ASSERT_TRUE(daemon.reach(before));
  }
};

TEST_F(DaemonAtTheFlame, ItBurnsWhileNothingIsAlignedSoThatCamerasCanBeExposedForIt) {
  SmallDaemon daemon(config());
  drivers::Camera& camera = daemon.rig->camera(0);
  static_cast<void>(camera.next_frame(Seconds(1)));
  EXPECT_GT(seen(*camera.next_frame(Seconds(1))->image).bright, 500);
  ASSERT_TRUE(daemon.locks());
  EXPECT_LT(seen(*camera.next_frame(Seconds(1))->image).bright, 500);
}

TEST_F(DaemonAtTheFlame, LongerExposuresAreBrighter) {
  const auto bright = [&](double ms) {
    rig::DaemonConfig longer = config();
    longer.rig.cameras[0].request.exposure = milliseconds(ms);
    SmallDaemon daemon(std::move(longer));
    static_cast<void>(daemon.rig->camera(0).next_frame(Seconds(1)));
    return seen(*daemon.rig->camera(0).next_frame(Seconds(1))->image);
  };
  EXPECT_GT(bright(4).saturated, 2 * bright(1).saturated + 50);
  EXPECT_LT(bright(0.1).bright, bright(1).bright / 2);
}

TEST_F(DaemonAtTheFlame, AStrobeThatFlashesBesideItIsSeen) {
  SmallDaemon daemon(config());
  drivers::Camera& camera = daemon.rig->camera(0);
  static_cast<void>(camera.next_frame(Seconds(1)));
  const int without = seen(*camera.next_frame(Seconds(1))->image).saturated;
  v1::StrobeState steady;
  steady.set_output(v1::StrobeState::STEADY);
  steady.set_rate_hz(24);
  steady.set_width_s(20e-6);
  ASSERT_TRUE(daemon.apply_strobe(steady).ok());
  for (int i = 0; i < 2; ++i) static_cast<void>(camera.next_frame(Seconds(1)));
  EXPECT_GT(seen(*camera.next_frame(Seconds(1))->image).saturated, without + 20);
}

TEST_F(DaemonAtTheFlame, RecordingsForAlignmentShowTheStrobeAndOthersTheFlame) {
  SmallDaemon daemon(config());
  record(daemon, "flame", "flame");
  record(daemon, "strobe", "alignment");
  EXPECT_GT(recorded("flame").bright, 500);
  const Light idle = recorded("strobe");
  EXPECT_LT(idle.bright, 500);
  EXPECT_GT(idle.saturated, 20) << "the lamp";
  EXPECT_EQ(daemon.read_strobe()->output(), v1::StrobeState::OFF) << "it flashed for that alone";
  ASSERT_TRUE(daemon.locks());
  record(daemon, "locked strobe", "alignment");
  EXPECT_GT(recorded("locked strobe").saturated, 20);
  record(daemon, "locked flame", "flame");
  EXPECT_GT(recorded("locked flame").bright, 500);
}

}  // namespace
}  // namespace emberlock
