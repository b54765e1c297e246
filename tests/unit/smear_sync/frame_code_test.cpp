// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/frame_code.h"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/clock_film.h"

namespace emberlock::smear {
namespace {

using test::ClockFilm;
using testing::HasSubstr;

const FrameCode kCode;

std::vector<CodeFrame> seen_in(const ClockFilm& f) {
  std::vector<CodeFrame> frames;
  for (const FrameReading& r : film(f)) frames.push_back({r.frame, flash_seen(r.reading)});
  return frames;
}

/// A camera whose frame 0 starts at flash `start` (a number of the code, with its fraction).
ClockFilm camera_at(double start, int frames = 240) {
  ClockFilm f{.flash_rate = 23.976, .frames = frames};
  f.code = flash_pattern(kCode).value();
  f.first_flash = -start / f.flash_rate;
  return f;
}

FrameNumbers numbers_of(const std::vector<CodeFrame>& frames, DecodeOptions options = {}) {
  auto numbers = number_frames(frames, options);
  EXPECT_TRUE(numbers.ok());
  return numbers.ok() ? *numbers : FrameNumbers{};
}

TEST(FrameCode, AnyTwoWindowsOfASpacingAndAWordDifferInTwelveFrames) {
  const auto pattern = flash_pattern(kCode).value();
  const std::size_t cycle = pattern.size();
  ASSERT_EQ(cycle, 3720U);
  constexpr std::size_t kWindow = 151;
  std::size_t nearest = kWindow;
  for (std::size_t shift = 1; shift <= cycle / 2; ++shift) {
    // Differences within a window that slides over the cycle.
    std::size_t differ = 0;
    const auto differs = [&](std::size_t i) {
      return std::size_t{pattern[i % cycle] != pattern[(i + shift) % cycle]};
    };
    for (std::size_t i = 0; i < kWindow; ++i) differ += differs(i);
    for (std::size_t i = 0; i < cycle; ++i) {
      nearest = std::min(nearest, differ);
      differ += differs(i + kWindow) - differs(i);
    }
  }
  EXPECT_EQ(nearest, 12U);
}

TEST(FrameCode, AtMostNineFlashesInARowAreSkippedAndAnEighthOfAll) {
  int run = 0;
  int skipped = 0;
  const auto pattern = flash_pattern(kCode).value();
  for (const bool flash : pattern) {
    run = flash ? 0 : run + 1;
    skipped += flash ? 0 : 1;
    EXPECT_LE(run, 9);
  }
  EXPECT_NEAR(skipped / 3720.0, 0.125, 0.005);
}

TEST(FrameCode, EveryStartIsToldFromTenSeconds) {
  for (int i = 0; i < 60; ++i) {
    const double start = random_uniform(3, 1, static_cast<std::uint64_t>(i)) * kCode.flashes();
    const auto numbers = numbers_of(seen_in(camera_at(start)));
    ASSERT_EQ(numbers.runs.size(), 1U) << numbers.reason;
    EXPECT_TRUE(numbers.drops.empty());
    EXPECT_NEAR(wrap_symmetric(numbers.runs[0].start - start, kCode.flashes()), 0,
                numbers.runs[0].start_slack);
    EXPECT_GT(numbers.runs[0].confidence, 0.999);
  }
}

TEST(FrameCode, ADotThatIsInvisibleNowAndThenDoesNoHarm) {
  int wrong = 0;
  for (int i = 0; i < 60; ++i) {
    RandomStream random(static_cast<std::uint64_t>(i), 4);
    const double start = random.uniform(0, kCode.flashes());
    auto frames = seen_in(camera_at(start));
    for (CodeFrame& f : frames) {
      const double what = random.uniform();
      if (what < 0.08) f.seen = f.seen == FlashSeen::yes ? FlashSeen::no : FlashSeen::yes;
      if (what > 0.85) f.seen = FlashSeen::unknown;
    }
    const auto numbers = numbers_of(frames, {.misread = 0.08});
    if (numbers.runs.empty()) continue;  // abstained
    wrong += std::abs(wrap_symmetric(numbers.runs[0].start - start, kCode.flashes())) > 0.5 ? 1 : 0;
    EXPECT_NEAR(numbers.misread, 0.08, 0.06);
  }
  EXPECT_EQ(wrong, 0);
}

TEST(FrameCode, ADroppedFrameIsCaughtAtTheNextWordAndPlacedBetweenTwo) {
  for (const int lost : {1, 2, 7}) {
    for (const int dropped_at : {60, 100, 230}) {
      std::vector<CodeFrame> frames = seen_in(camera_at(kCode.spacing * 5 - 10.3, 480));
      frames.erase(frames.begin() + dropped_at, frames.begin() + dropped_at + lost);
      for (std::size_t i = 0; i < frames.size(); ++i)
        frames[i].frame = static_cast<std::int64_t>(i);  // it hides it
      const auto numbers = numbers_of(frames);
      ASSERT_EQ(numbers.drops.size(), 1U) << numbers.reason;
      EXPECT_EQ(numbers.drops[0].frames, lost);
      EXPECT_LT(numbers.drops[0].after, dropped_at);
      EXPECT_GE(numbers.drops[0].before, dropped_at);
      EXPECT_LT(numbers.drops[0].before - numbers.drops[0].after, kCode.spacing);
      ASSERT_EQ(numbers.runs.size(), 2U);
      EXPECT_NEAR(numbers.runs[1].start - numbers.runs[0].start,
                  static_cast<double>(numbers.runs[1].first - numbers.runs[0].first) + lost, 1e-9);
    }
  }
}

TEST(FrameCode, FramesThatTheCameraOwnsUpToAreNoLoss) {
  std::vector<CodeFrame> frames = seen_in(camera_at(777.4));
  frames.erase(frames.begin() + 60, frames.begin() + 75);
  const auto numbers = numbers_of(frames);
  ASSERT_EQ(numbers.runs.size(), 1U);
  EXPECT_TRUE(numbers.drops.empty());
}

TEST(FrameCode, ADoubledFrameIsALossOfLessThanNone) {
  std::vector<CodeFrame> frames = seen_in(camera_at(100.5, 360));
  frames.insert(frames.begin() + 190, frames[190]);
  for (std::size_t i = 0; i < frames.size(); ++i) frames[i].frame = static_cast<std::int64_t>(i);
  const auto numbers = numbers_of(frames);
  ASSERT_EQ(numbers.drops.size(), 1U);
  EXPECT_EQ(numbers.drops[0].frames, -1);
}

TEST(FrameCode, ABeatThatCarriesTheFlashOverTheFramesBorder) {
  for (const double beat : {-800e-6, 800e-6}) {
    for (const double phase : {0.02, 0.97}) {
      ClockFilm f = camera_at(300.0 + 1 - phase, 300);
      f.timing.frame_period = Seconds((1 + beat) / f.flash_rate);
      const double step = f.timing.frame_period.value() * f.flash_rate;
      const auto with = numbers_of(seen_in(f), {.flashes_per_frame = step, .first_phase = phase});
      ASSERT_EQ(with.runs.size(), 1U) << with.reason;
      EXPECT_NEAR(with.runs[0].start, 301 - phase, 1e-9);
      const auto without = numbers_of(seen_in(f), {.flashes_per_frame = step});
      ASSERT_EQ(without.runs.size(), 1U) << without.reason << ", beat " << beat << ", phase " << phase;
      EXPECT_NEAR(without.runs[0].start, 301 - phase, without.runs[0].start_slack + 0.03);
    }
  }
}

// One flash lights picture i of one camera and picture i + 1 of another when it falls just after one read
// phase began and just before the other: in step, though the numbers differ.
TEST(FrameCode, OneFrameAmbiguityIsSettledByThePhases) {
  const ClockFilm a = camera_at(1000.01);
  const ClockFilm b = camera_at(997.99);
  const auto of = [&](const ClockFilm& f, double start) {
    const auto numbers = numbers_of(seen_in(f), {.first_phase = wrap_positive(-start, 1)});
    return numbers.runs.empty() ? NumberedRun{} : numbers.runs[0];
  };
  const auto offset = frame_offset(of(a, 1000.01), of(b, 997.99), kCode, 120);
  EXPECT_EQ(offset.frames, 2);
  EXPECT_NEAR(offset.lag, 0.02, 1e-9);
  EXPECT_EQ(frame_offset(of(b, 997.99), of(a, 1000.01), kCode, 120).frames, -2);
  // Without the phases it says that it may be off.
  const auto blind =
      frame_offset(numbers_of(seen_in(a)).runs.at(0), numbers_of(seen_in(b)).runs.at(0), kCode, 120);
  EXPECT_THAT(blind.reason, HasSubstr("a phase isn't known"));
}

TEST(FrameCode, OffsetsAcrossTheEndOfTheCycle) {
  const auto a = numbers_of(seen_in(camera_at(kCode.flashes() - 30.6))).runs.at(0);
  const auto b = numbers_of(seen_in(camera_at(40.4))).runs.at(0);
  EXPECT_EQ(frame_offset(a, b, kCode, 10).frames, -71);
}

TEST(FrameCode, WithoutACodeNothingIsNumbered) {
  ClockFilm steady = camera_at(5.5);
  steady.code.clear();
  const auto all = numbers_of(seen_in(steady));
  EXPECT_TRUE(all.runs.empty());
  EXPECT_THAT(all.reason, HasSubstr("play the code"));
  std::vector<CodeFrame> dark(200);
  for (std::size_t i = 0; i < dark.size(); ++i) dark[i] = {static_cast<std::int64_t>(i), FlashSeen::no};
  const auto none = numbers_of(dark);
  EXPECT_TRUE(none.runs.empty());
  EXPECT_THAT(none.reason, HasSubstr("no frame shows the lamp"));
  RandomStream random(3, 3);
  for (CodeFrame& f : dark) f.seen = random.uniform() < 0.5 ? FlashSeen::yes : FlashSeen::no;
  EXPECT_TRUE(numbers_of(dark).runs.empty()) << "chance is no code";
  EXPECT_FALSE(numbers_of({}).reason.empty());
}

TEST(FrameCode, OptionsOutOfRangeAreRefused) {
  EXPECT_FALSE(flash_pattern({.words = 0}).ok());
  EXPECT_FALSE(flash_pattern({.words = 32}).ok());
  EXPECT_FALSE(flash_pattern({.spacing = 31}).ok());
  const std::vector<CodeFrame> frames(3);
  EXPECT_FALSE(number_frames(frames, {}).ok()) << "all have the same count";
  EXPECT_FALSE(number_frames({}, {.flashes_per_frame = 2}).ok());
  EXPECT_FALSE(number_frames({}, {.first_phase = 1.0}).ok());
  EXPECT_FALSE(number_frames({}, {.misread = 0}).ok());
}

}  // namespace
}  // namespace emberlock::smear
