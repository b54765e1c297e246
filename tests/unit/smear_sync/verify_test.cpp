// SPDX-License-Identifier: Apache-2.0
// What clips of one strobe prove, told from readings made of flashes and shift registers alone.
#include "smear_sync/verify/verify.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/random.h"
#include "tests/support/strobe_readings.h"

namespace emberlock::smear {
namespace {

using testing::ContainsRegex;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Camera = test::ReadCamera;

constexpr SecondsPerRow kClipRow = microseconds_per_row(54);

/// The period of a camera that is slower than its nominal rate.
double period_of(double ppm) { return (1 + ppm * 1e-6) / 23.976; }

const FrameCode kShortCycle{.words = 8, .spacing = 60};  // quickly told

test::ReadStrobe coded(double rate = 24.2) {
  return {.rate = rate, .width = 0, .given = flash_pattern(kShortCycle).value(), .repeats = true};
}
test::ReadStrobe uncoded(double rate = 24.2) { return {.rate = rate, .width = 0}; }

ClipReading film(const Camera& camera, std::uint64_t seed = 1, const test::ReadStrobe& strobe = coded()) {
  return test::read_strobe(camera, strobe, kClipRow, seed);
}

VerifyOptions options_of(const test::ReadStrobe& strobe = coded()) {
  VerifyOptions options;
  options.clip.flash_rate = Hertz(strobe.rate);
  options.clip.row_time = kClipRow;
  options.clip.code = kShortCycle;
  return options;
}

VerifyResult verify(const std::vector<Camera>& cameras, const test::ReadStrobe& strobe = coded(),
                    std::optional<VerifyOptions> options = {}) {
  std::vector<ClipReading> clips;
  for (const Camera& c : cameras) {
    clips.push_back(film(c, clips.size() + 1, strobe));
    clips.back().name = "camera " + std::to_string(clips.size() - 1);
  }
  return verify_clips(clips, options.value_or(options_of(strobe))).value();
}

/// tau - tau_reference at the middle of the reference, and the frame that starts nearest to that one.
struct Truth {
  double error_ms;
  int offset;
};
Truth truth(const Camera& reference, const Camera& camera) {
  const int middle = reference.frames / 2;
  const double here = reference.read_start(middle);
  const int place = static_cast<int>(std::lround((here - camera.start) / camera.period));
  return {1e3 * (here - camera.read_start(place)), place - middle};
}

TEST(VerifySlow, RandomRigsComeOutWithinMicrosecondsAndToTheFrame) {
  RandomStream random(20, 1);
  for (int rig = 0; rig < 15; ++rig) {
    std::vector<Camera> cameras(4);
    for (Camera& c : cameras) {
      c = {.start = random.uniform(0, 6),
           .period = period_of(random.uniform(-25, 25)),
           .shifts = std::vector{720, 740, 772}[static_cast<std::size_t>(random.uniform(0, 3))],
           .direction = random.uniform() < 0.5 ? -1 : +1,
           .lamp = random.uniform(200, 520)};
    }
    const VerifyResult result = verify(cameras, coded(random.uniform() < 0.5 ? 24.2 : 23.78));
    for (std::size_t i = 1; i < cameras.size(); ++i) {
      const CameraVerdict& c = result.cameras[i];
      ASSERT_TRUE(c.error && c.drift) << "rig " << rig << ": " << c.reason;
      const Truth expected = truth(cameras[0], cameras[i]);
      EXPECT_EQ(c.frame_offset, expected.offset)
          << "rig " << rig << " camera " << i << ": " << c.offset_reason;
      EXPECT_NEAR(wrap_symmetric(in_milliseconds(*c.error) - expected.error_ms, 1000 / 23.976), 0, 0.01)
          << "rig " << rig << " camera " << i;
      const double slower = (cameras[0].period - cameras[i].period) * 23.976e6;
      EXPECT_NEAR(c.drift->value(), slower, 3) << "rig " << rig << " camera " << i;
      EXPECT_EQ(c.clock.timing.direction == ReadDirection::top_first, cameras[i].direction > 0);
      EXPECT_EQ(c.clock.timing.shifts, cameras[i].shifts);
    }
  }
}

TEST(Verify, StatesFollowTheToleranceAndTheWorstPairTakesBothSides) {
  const Camera reference{.start = 1};
  const Camera earlier{.start = 1 - 0.004, .lamp = 400};
  const Camera later{.start = 1 + 0.005, .lamp = 250};
  VerifyOptions options = options_of();
  options.tolerance = {milliseconds(4.5)};
  const VerifyResult result = verify({reference, earlier, later}, coded(), options);
  EXPECT_EQ(result.cameras[1].state, ClipState::in_sync);
  EXPECT_NEAR(in_milliseconds(*result.cameras[1].error), 4, 0.01);
  EXPECT_EQ(result.cameras[2].state, ClipState::out_of_tolerance);
  EXPECT_NEAR(in_milliseconds(*result.worst_pair), 9, 0.01);
  EXPECT_EQ(result.verdict, ClipsVerdict::out_of_tolerance);
  EXPECT_THAT(result.to_do, ElementsAre(HasSubstr("Reset the shutter of camera 2")));
  EXPECT_THAT(result.to_do[0], ContainsRegex("(4\\.99|5\\.0[01]) ms \\(93 rows\\) earlier"));
  options.tolerance = {milliseconds(5.5)};
  EXPECT_EQ(verify({reference, earlier, later}, coded(), options).verdict, ClipsVerdict::in_sync);
  options.tolerance = {milliseconds(4.0)};
  EXPECT_EQ(verify({reference, earlier}, coded(), options).cameras[1].state, ClipState::ambiguous);
}

TEST(Verify, ALostFrameIsCountedAndTheOffsetIsThatOfTheMiddle) {
  const Camera whole{.start = 1};
  const Camera holed{.start = 0.2, .period = period_of(9), .direction = -1, .lost = {40}};
  const VerifyResult result = verify({whole, holed});
  const CameraVerdict& c = result.cameras[1];
  ASSERT_EQ(c.clock.numbers.drops.size(), 1U) << c.clock.numbers.reason;
  EXPECT_EQ(c.clock.numbers.drops[0].frames, 1);
  EXPECT_EQ(c.frame_offset, truth(whole, holed).offset - 1);
  EXPECT_NEAR(in_milliseconds(*c.error), truth(whole, holed).error_ms, 0.02);
  EXPECT_NEAR(c.drift->value(), -9, 2);
  EXPECT_THAT(result.to_do, testing::Contains(HasSubstr("lost 1 frame")));
}

TEST(Verify, WithoutACodeNoFramesArePairedAndABeatLeavesTheErrorOpen) {
  const VerifyResult result = verify({{.start = 1}, {.start = 1.002}}, uncoded());
  const CameraVerdict& c = result.cameras[1];
  EXPECT_FALSE(c.frame_offset);
  EXPECT_FALSE(c.offset_reason.empty());
  EXPECT_EQ(c.state, ClipState::ambiguous);
  EXPECT_EQ(result.verdict, ClipsVerdict::not_proven);
  EXPECT_THAT(result.to_do, ElementsAre(HasSubstr("skip flashes in its code")));
}

TEST(Verify, WithoutACodeAStrobeInTuneStillTellsTheError) {
  VerifyOptions options = options_of(uncoded(23.976));
  options.clip.direction = ReadDirection::top_first;
  const VerifyResult result = verify(
      {{.start = 1 - 0.012, .period = period_of(12)}, {.start = 1.002 - 0.012, .period = period_of(-5)}},
      uncoded(23.976), options);
  const CameraVerdict& c = result.cameras[1];
  ASSERT_TRUE(c.error) << c.reason;
  EXPECT_NEAR(in_milliseconds(*c.error), -2, 0.2);
  EXPECT_EQ(c.state, ClipState::in_sync) << c.reason;
}

TEST(Verify, AStrobeInTuneLeavesTheDirectionOpenAndSaysHowToTellIt) {
  const VerifyResult result = verify({{.start = 1 - 0.012}, {.start = 1.002 - 0.012}}, uncoded(23.976));
  EXPECT_EQ(result.cameras[1].state, ClipState::direction_unknown);
  EXPECT_FALSE(result.cameras[1].error);
  EXPECT_EQ(result.verdict, ClipsVerdict::not_proven);
  EXPECT_THAT(result.to_do, testing::Contains(HasSubstr("Detune the strobe")));
}

TEST(Verify, AStrobeInTuneTellsNoDirectionByWayOfAFrameRateNearby) {
  // 24 frames a second would read this walk the other way around, were the claim only rounded.
  for (const int direction : {-1, +1}) {
    for (const double rate : {23.9775, 23.974}) {
      std::vector<Camera> cameras(2, {.start = 1 - 0.012, .direction = direction});
      for (const CameraVerdict& c : verify(cameras, uncoded(rate)).cameras)
        EXPECT_FALSE(c.clock.mode.direction) << c.clock.mode.direction_reason;
    }
  }
}

TEST(Verify, AStrobeInTuneTellsTheDirectionByTheFlashesThatItSkips) {
  for (const int direction : {-1, +1}) {
    const Camera first{.start = 1 - 0.012, .direction = direction};
    const Camera second{.start = 1.002 - 0.012, .direction = direction};
    const VerifyResult result = verify({first, second}, coded(23.976));
    const CameraVerdict& c = result.cameras[1];
    ASSERT_TRUE(c.clock.mode.direction) << c.clock.mode.direction_reason;
    EXPECT_EQ(static_cast<int>(*c.clock.mode.direction), direction);
    ASSERT_TRUE(c.error) << c.reason;
    EXPECT_NEAR(in_milliseconds(*c.error), truth(first, second).error_ms, 0.2);
    EXPECT_EQ(c.frame_offset, truth(first, second).offset) << c.offset_reason;
  }
}

TEST(Verify, ABlindCameraIsNoErrorAndNoSync) {
  VerifyOptions options = options_of(coded(23.976));
  options.clip.direction = ReadDirection::top_first;
  // The flash comes 1.5 ms before the read phase ends its rest.
  const VerifyResult result =
      verify({{.start = 1 - 0.012}, {.start = std::ceil(23.976) / 23.976 + 0.0015}}, coded(23.976), options);
  EXPECT_EQ(result.cameras[1].state, ClipState::blind) << result.cameras[1].reason;
  EXPECT_FALSE(result.cameras[1].error);
  EXPECT_THAT(result.to_do, testing::Contains(HasSubstr("Bring the dot of camera 1 out")));
}

TEST(Verify, AReferenceWithoutPhaseGivesWayToTheNextClip) {
  std::vector<ClipReading> clips = {film({.start = 1}), film({.start = 1}), film({.start = 1.001})};
  for (SmearReading& frame : clips[0].frames) frame = SmearReading{SmearState::no_lamp, {}, {}, "no lamp"};
  const VerifyResult result = verify_clips(clips, options_of()).value();
  EXPECT_EQ(result.reference, 1U);
  EXPECT_EQ(result.cameras[0].state, ClipState::unusable);
  EXPECT_THAT(result.cameras[0].reason, HasSubstr("no lamp"));
  EXPECT_EQ(result.cameras[2].state, ClipState::in_sync);
  EXPECT_EQ(result.verdict, ClipsVerdict::not_proven);
}

TEST(Verify, AClipOfAnotherStrobeIsFoundOut) {
  const std::vector<ClipReading> clips = {film({.start = 1}), film({.start = 1}, 1, coded(24.4))};
  const VerifyResult result = verify_clips(clips, options_of()).value();
  EXPECT_EQ(result.cameras[0].state, ClipState::in_sync);
  EXPECT_TRUE(result.cameras[1].state == ClipState::unusable ||
              result.cameras[1].state == ClipState::direction_unknown)
      << name(result.cameras[1].state);
  EXPECT_FALSE(result.cameras[1].reason.empty());
}

TEST(Verify, ARoundedClaimOfTheFrameRateIsSeenThrough) {
  for (const auto claim :
       {std::optional(Hertz(24)), std::optional(Hertz(24000.0 / 1001)), std::optional<Hertz>()}) {
    std::vector<ClipReading> clips = {film({.start = 1}), film({.start = 1.001, .direction = -1})};
    for (ClipReading& clip : clips) clip.claimed_rate = claim;
    const VerifyResult result = verify_clips(clips, options_of()).value();
    ASSERT_TRUE(result.cameras[1].error) << result.cameras[1].reason;
    EXPECT_NEAR(in_milliseconds(*result.cameras[1].error), -1, 0.01);
  }
}

TEST(Verify, AClaimFarFromTheStrobesRateIsUnusableAndSaysWhy) {
  std::vector<ClipReading> clips = {film({.start = 1}), film({.start = 1})};
  clips[1].claimed_rate = Hertz(59.94);
  const VerifyResult result = verify_clips(clips, options_of()).value();
  EXPECT_EQ(result.cameras[1].state, ClipState::unusable);
  EXPECT_THAT(result.cameras[1].reason, HasSubstr("59.940 frames a second"));
}

TEST(Verify, ADotWhoseLampWasNotLitIsNoLamp) {
  std::vector<ClipReading> clips = {film({.start = 1}), film({.start = 0.3})};
  int changed = 0;
  for (std::size_t i = 0; i < clips[1].frames.size(); ++i) {
    SmearReading& frame = clips[1].frames[i];
    if (frame.lamp) continue;
    frame.state = SmearState::no_dot;
    frame.lamp = LampReading{.x = 600, .y = Rows(500), .sigma = Rows(0.1), .radius = 4};
    ++changed;
  }
  ASSERT_GT(changed, 5);
  const VerifyResult result = verify_clips(clips, options_of()).value();
  EXPECT_EQ(result.cameras[1].frame_offset, truth({.start = 1}, {.start = 0.3}).offset)
      << result.cameras[1].offset_reason;
  EXPECT_EQ(result.cameras[1].clock.numbers.misread, 0);
}

TEST(Verify, AShortClipSaysThatItIsShort) {
  const VerifyResult result = verify({{.start = 1}, {.start = 1, .frames = 4}});
  EXPECT_EQ(result.cameras[1].state, ClipState::unusable);
  EXPECT_THAT(result.cameras[1].reason, HasSubstr("4 frames only"));
}

TEST(Verify, OneClipOrASenselessRateIsRefused) {
  const std::vector<ClipReading> clips = {film({.start = 1}), film({.start = 1})};
  const auto one = verify_clips(std::span(clips).first(1), options_of());
  ASSERT_FALSE(one.ok());
  EXPECT_THAT(one.error().message(), HasSubstr("two cameras"));
  for (const double bad : {0.0, -24.0, std::nan("")}) {
    VerifyOptions options = options_of();
    options.clip.flash_rate = Hertz(bad);
    EXPECT_FALSE(verify_clips(clips, options).ok());
    options = options_of();
    options.clip.row_time = SecondsPerRow(bad);
    EXPECT_FALSE(verify_clips(clips, options).ok());
  }
}

}  // namespace
}  // namespace emberlock::smear
