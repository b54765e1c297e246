// SPDX-License-Identifier: Apache-2.0
// The line through a clip's dots, and what it says of its own error; and which way a camera reads, told by
// the frames before dark ones.
#include "smear_sync/verify/clip_line.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/square.h"
#include "smear_sync/verify/dark_direction.h"
#include "tests/support/light_patterns.h"
#include "tests/support/strobe_readings.h"

namespace emberlock::smear {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr SecondsPerRow kOfTheseClips = microseconds_per_row(54);

ClipOptions options_for(const test::ReadStrobe& strobe) {
  ClipOptions options;
  options.flash_rate = Hertz(strobe.rate);
  options.row_time = kOfTheseClips;
  options.row_time_sigma = SecondsPerRow(1e-10);
  return options;
}

/// By how much a clip's phase in mid-film errs, in its own standard errors; nothing where it has none.
std::optional<double> standardised_error(const ClipClock& clock, const test::ReadCamera& camera,
                                         const test::ReadStrobe& strobe) {
  if (clock.state != PhaseState::known || !clock.mode.direction || clock.tau_slack > Seconds(0)) return {};
  const int middle = camera.frames / 2;
  const Phase phase = clock.phase_of_frame(middle);
  const double flashes = 1 / strobe.rate;
  const double tau = wrap_positive(-camera.read_start(middle), flashes);
  return wrap_symmetric(phase.tau.value() - tau, flashes) / phase.sigma.value();
}

TEST(ClipLineSlow, ErrsAsItStatesWhereASlowBeatCarriesTheDotsPastTheLampOfACameraWhoseShiftsAreInDoubt) {
  double squares = 0;
  int clips = 0;
  int in_doubt = 0;
  for (std::uint64_t seed = 1; seed <= 90; ++seed) {
    RandomStream random(seed, 31);
    test::ReadCamera camera;
    camera.frames = static_cast<int>(random.uniform(96, 150));
    camera.period = (1 + random.uniform(-25e-6, 25e-6)) / 23.976;
    camera.shifts = static_cast<int>(random.uniform(720, 770));
    camera.direction = random.uniform() < 0.5 ? -1 : +1;
    camera.lamp = random.uniform(200, 520);
    test::ReadStrobe strobe;
    strobe.rate = 23.976 * (1 + (random.uniform() < 0.5 ? -1 : 1) * random.uniform(5e-4, 1e-3));
    strobe.given = test::light_pattern(test::kTellingPatterns.at(seed % test::kTellingPatterns.size()),
                                       2 * camera.frames, random);
    // Some frame's read phase begins with a flash.
    camera.start =
        10 / strobe.rate - random.uniform(0.2, 0.8) * camera.frames * (camera.period - 1 / strobe.rate);
    const ClipClock clock =
        read_clip_clock(test::read_strobe(camera, strobe, kOfTheseClips, seed), options_for(strobe)).value();
    const auto error = standardised_error(clock, camera, strobe);
    if (!error) continue;
    ++clips;
    in_doubt += clock.mode.shifts ? 0 : 1;
    squares += square(*error);
    EXPECT_LT(std::abs(*error), 5) << seed << ": K told as " << clock.timing.shifts << ", truly "
                                   << camera.shifts << "; " << clock.mode.shifts_reason;
  }
  EXPECT_GT(clips, 60);
  EXPECT_GT(in_doubt, 20);
  EXPECT_LT(squares / clips, 1.6);
  EXPECT_GT(squares / clips, 0.1) << "sigmas that are far too wide say nothing either";
}

TEST(ClipLine, LeavesOutTheFewDotsOfTheOtherSideWhileNothingTellsTheShifts) {
  // Three dots or four that did not wrap; then the flash walks behind the lamp and into the rest, and a
  // hundred that wrapped follow.
  const test::ReadStrobe strobe{.rate = 23.976 * (1 + 5e-4), .given = std::vector<bool>(400, true)};
  const test::ReadCamera camera{
      .start = 20 / strobe.rate - 13.3 * kOfTheseClips.value(), .shifts = 760, .frames = 200};
  const ClipReading clip = test::read_strobe(camera, strobe, kOfTheseClips, 4);
  const ClipClock clock = read_clip_clock(clip, options_for(strobe)).value();
  std::array<int, 2> sides{};  // below the lamp, above it
  for (const ClipPoint& p : clock.points) ++sides[p.y < clock.lamp ? 1 : 0];
  std::array<int, 2> dots{};
  for (const SmearReading& r : clip.frames) {
    if (r.state == SmearState::dot) ++dots[r.dots.front().y < clock.lamp ? 1 : 0];
  }
  ASSERT_GT(std::min(dots[0], dots[1]), 0);
  ASSERT_LT(std::min(dots[0], dots[1]), 5);
  EXPECT_EQ(std::min(sides[0], sides[1]), 0);
  EXPECT_EQ(std::max(sides[0], sides[1]), std::max(dots[0], dots[1]));
  EXPECT_NEAR((clock.tau_slack / kOfTheseClips).value(), 772 - 720, 1e-6) << "whatever K is";
}

/// What the frames of a camera tell whose read phases begin `tau` before a flash, under a strobe in tune.
DarkDirection told_by_dark(int direction, double tau, test::LightPattern pattern, std::uint64_t seed = 3) {
  RandomStream random(seed, 8);
  test::ReadStrobe strobe{.rate = 23.976, .given = test::light_pattern(pattern, 400, random)};
  const test::ReadCamera camera{.start = 20 / 23.976 - tau, .direction = direction, .frames = 240};
  std::vector<FrameReading> frames;
  for (const SmearReading& reading : test::read_strobe(camera, strobe, kOfTheseClips, seed).frames)
    frames.push_back({static_cast<std::int64_t>(frames.size()), reading});
  return direction_by_dark_frames(frames);
}

TEST(ClipClock, CountsEachLossFromItsPlaceInTheFile) {
  ClipClock clock;
  clock.numbers.drops = {{.after = 99, .before = 100, .frames = 5},
                         {.after = 199, .before = 200, .frames = 3}};
  EXPECT_EQ(clock.count_of(99), 99);
  EXPECT_EQ(clock.count_of(100), 105);
  EXPECT_EQ(clock.count_of(199), 204);
  EXPECT_EQ(clock.count_of(200), 208);
}

TEST(DarkDirection, IsToldWhereTheDotDoesNotWalkAtAllOnEitherSideOfTheLamp) {
  for (const int direction : {-1, +1}) {
    for (const double tau : {0.006, 0.033}) {
      for (const auto pattern : {test::LightPattern::hand, test::LightPattern::code,
                                 test::LightPattern::few_skips, test::LightPattern::torch}) {
        const DarkDirection told = told_by_dark(direction, tau, pattern);
        ASSERT_TRUE(told.direction) << direction << " " << tau << " " << name(pattern) << ": " << told.reason;
        EXPECT_EQ(static_cast<int>(*told.direction), direction) << tau << " " << name(pattern);
        EXPECT_THAT(told.reason, HasSubstr("before a dark one"));
      }
    }
  }
}

TEST(DarkDirection, IsNotToldBySteadyLightNorByOneSwipe) {
  EXPECT_FALSE(told_by_dark(+1, 0.006, test::LightPattern::steady).direction);
  EXPECT_THAT(told_by_dark(+1, 0.006, test::LightPattern::steady).reason, IsEmpty());
  const DarkDirection once = told_by_dark(+1, 0.006, test::LightPattern::one_swipe);
  EXPECT_FALSE(once.direction);
  EXPECT_THAT(once.reason, HasSubstr("too little"));
}

TEST(DarkDirection, IsNotToldWhereAHalfCoveredLampLacksItsDotAtBothEndsOfALitStretch) {
  std::vector<FrameReading> frames;
  for (int i = 0; i < 120; ++i) {
    SmearReading reading;
    const int place = i % 12;
    if (place < 9) {
      reading.lamp = LampReading{.x = 600, .y = Rows(300), .sigma = Rows(0.1), .radius = 4};
      const bool half = place == 0 || place == 8;
      reading.state = half ? SmearState::no_dot : SmearState::dot;
      if (!half) reading.dots.push_back({.x = 600, .y = Rows(420), .sigma = Rows(0.05)});
    }
    frames.push_back({i, reading});
  }
  EXPECT_FALSE(direction_by_dark_frames(frames).direction) << direction_by_dark_frames(frames).reason;
}

}  // namespace
}  // namespace emberlock::smear
