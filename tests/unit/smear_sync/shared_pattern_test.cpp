// SPDX-License-Identifier: Apache-2.0
// Frames that belong together are found by patterns that nobody chose, or not at all.
#include "smear_sync/clocks/shared_pattern.h"

#include <cmath>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "smear_sync/clocks/pattern_model.h"
#include "tests/support/light_patterns.h"

namespace emberlock::smear {
namespace {

using test::LightPattern;
using testing::HasSubstr;

/// Clips of one row of flashes: which flash each begins with, and how many frames it has.
struct FilmedPart {
  int first, frames;
};

PatternClip clip_of(const std::vector<bool>& given, const FilmedPart& filmed, double misread = 0,
                    std::uint64_t seed = 1) {
  RandomStream random(seed, 9);
  PatternClip clip;
  for (int i = 0; i < filmed.frames; ++i) {
    const bool lit = given[static_cast<std::size_t>(filmed.first + i)] != (random.uniform() < misread);
    clip.frames.push_back({i + 0.4, lit ? FlashSeen::yes : FlashSeen::no});
  }
  return clip;
}

std::vector<PatternMatch> matched(const std::vector<PatternClip>& clips, std::size_t reference = 0) {
  return match_patterns(clips, reference, {}).value();
}

std::vector<bool> lights_of(LightPattern kind, std::uint64_t seed = 1) {
  RandomStream random(seed, 3);
  return test::light_pattern(kind, 400, random);
}

TEST(SharedPattern, OfAHandATorchABurstOrAnUnknownCodeTellsTheShiftOfNearlyEveryClipAndNoneWrongly) {
  int told = 0;
  for (const LightPattern kind : test::kTellingPatterns) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const auto given = lights_of(kind, seed);
      const auto found = matched({clip_of(given, {30, 150}), clip_of(given, {52, 150}, 0.01, seed),
                                  clip_of(given, {7, 150}, 0.01, seed + 9)});
      EXPECT_EQ(found[0].shift->flashes, 0);
      for (const auto& [clip, shift] : {std::pair{1U, 22}, {2U, -23}}) {
        if (!found[clip].shift) {
          EXPECT_FALSE(found[clip].reason.empty());
          continue;
        }
        ++told;
        EXPECT_EQ(found[clip].shift->flashes, shift) << name(kind) << " " << seed;
        EXPECT_GE(found[clip].shift->probability, 0.999);
      }
    }
  }
  EXPECT_GE(told, 37);  // of 40
}

TEST(SharedPattern, ThatRepeatsIsGivenUpUnlessItsEndShows) {
  std::vector<bool> given;
  for (int i = 0; i < 400; ++i) given.push_back(i % 10 < 6);
  const auto open = matched({clip_of(given, {30, 100}), clip_of(given, {53, 100})});
  ASSERT_FALSE(open[1].shift);
  EXPECT_THAT(open[1].reason, HasSubstr("repeats"));
  // Bursts that only one clip sees begin and the other sees end: any number of them may lie between.
  for (int i = 0; i < 400; ++i) given[static_cast<std::size_t>(i)] = i >= 60 && i < 200 && i % 10 < 6;
  EXPECT_FALSE(matched({clip_of(given, {30, 96}), clip_of(given, {130, 96})})[1].shift);
  const auto both = matched({clip_of(given, {30, 96}), clip_of(given, {44, 96})});
  ASSERT_TRUE(both[1].shift) << both[1].reason;
  EXPECT_EQ(both[1].shift->flashes, 14);
}

TEST(SharedPattern, OfUnrelatedSteadyOrOnceDarkenedClipsIsGivenUp) {
  const auto a = lights_of(LightPattern::hand, 5);
  const auto b = lights_of(LightPattern::hand, 6);
  EXPECT_FALSE(matched({clip_of(a, {0, 150}), clip_of(b, {0, 150})})[1].shift);
  const std::vector<bool> steady(400, true);
  const auto none = matched({clip_of(steady, {0, 100}), clip_of(steady, {9, 100})});
  ASSERT_FALSE(none[1].shift);
  EXPECT_THAT(none[1].reason, HasSubstr("no pattern"));
  // One stop of the light is the same stop, or it isn't.
  const auto swipe = lights_of(LightPattern::one_swipe);
  EXPECT_FALSE(matched({clip_of(swipe, {100, 96}), clip_of(swipe, {110, 96})})[1].shift);
}

TEST(SharedPattern, IsNotFoundWhereFramesWereLostInMidClip) {
  const auto given = lights_of(LightPattern::code);
  PatternClip holed = clip_of(given, {40, 120});
  holed.frames.erase(holed.frames.begin() + 50, holed.frames.begin() + 53);
  for (std::size_t i = 0; i < holed.frames.size(); ++i) holed.frames[i].start = static_cast<double>(i) + 0.4;
  const auto found = matched({clip_of(given, {30, 120}), holed});
  EXPECT_FALSE(found[1].shift) << found[1].shift->flashes;
}

TEST(SharedPattern, OfTwoClipsThatShareLittleIsToldByAThirdBetweenThem) {
  const auto given = lights_of(LightPattern::code, 3);
  const PatternClip a = clip_of(given, {0, 100});
  const PatternClip b = clip_of(given, {95, 100});
  EXPECT_FALSE(matched({a, b})[1].shift);
  const auto found = matched({a, b, clip_of(given, {45, 100})});
  ASSERT_TRUE(found[1].shift) << found[1].reason;
  EXPECT_EQ(found[1].shift->flashes, 95);
}

TEST(SharedPattern, OfAnotherWitnessNeedsOnlyToSayWhichTurnOfARepetition) {
  std::vector<bool> given;
  for (int i = 0; i < 400; ++i) given.push_back(i % 20 < 12 && i % 7 != 3);
  std::vector<bool> repeated;
  for (int i = 0; i < 400; ++i) repeated.push_back(given[static_cast<std::size_t>(i % 20)]);
  std::vector<PatternClip> clips{clip_of(repeated, {30, 100}), clip_of(repeated, {53, 100})};
  EXPECT_FALSE(matched(clips)[1].shift);
  clips[0].told_origin = 0;
  clips[0].told_sigma = 0.01;
  clips[1].told_origin = 23.4;
  clips[1].told_sigma = 0.7;
  SharedPatternOptions options;
  options.told_wrong = 1e-4;
  const auto found = match_patterns(clips, 0, options).value();
  ASSERT_TRUE(found[1].shift) << found[1].reason;
  EXPECT_EQ(found[1].shift->flashes, 23);
}

TEST(SharedPattern, RefusesSenselessOptions) {
  const std::vector<PatternClip> clips(2);
  EXPECT_FALSE(match_patterns(clips, 2, {}).ok());
  for (const double bad : {0.0, 0.5, 2.0, std::nan("")}) {
    SharedPatternOptions options;
    options.misread = bad;
    EXPECT_FALSE(match_patterns(clips, 0, options).ok());
    options = {};
    options.flashes_per_frame = bad;
    EXPECT_FALSE(match_patterns(clips, 0, options).ok());
  }
  EXPECT_FALSE(matched(clips)[1].shift) << "clips without frames";
}

TEST(PatternModel, IsAProbabilityOfAllThatMayCome) {
  double sum = 0;
  for (unsigned bits = 0; bits < 1024; ++bits) {
    PatternModel model({2, 3, 5});
    double log = 0;
    for (unsigned i = 0; i < 10; ++i) {
      const bool lit = (bits >> i & 1U) != 0;
      log += model.next(lit ? 1 : 0, lit ? 0 : 1);
    }
    sum += std::exp(log);
  }
  EXPECT_NEAR(sum, 1, 1e-9);
}

TEST(PatternModel, FindsThatWhatRepeatsProvesNothing) {
  const auto given = lights_of(LightPattern::code);
  PatternModel model({40});
  std::vector<double> turns;
  for (int turn = 0; turn < 4; ++turn) {
    turns.push_back(0);
    for (std::size_t i = 0; i < 40; ++i)
      turns.back() += model.next(given[i] ? 0.99 : 0.01, given[i] ? 0.01 : 0.99);
  }
  EXPECT_LT(turns[0], -15);
  EXPECT_GT(turns[2], -4);
  EXPECT_GT(turns[3], -4);
}

}  // namespace
}  // namespace emberlock::smear
