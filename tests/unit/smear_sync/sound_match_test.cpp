// SPDX-License-Identifier: Apache-2.0
// What claps in sound tracks say of clips, and what they can't.
#include "smear_sync/verify/sound_match.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/random.h"

namespace emberlock::smear {
namespace {

/// Noise, and claps at instants after the first frame that die away within a tenth of a second.
SoundTrack clapped(const std::vector<double>& claps, std::uint64_t seed = 1, double begin = 0) {
  RandomStream random(seed, 4);
  SoundTrack sound{.begin = Seconds(begin)};
  for (int i = 0; i < 6000; ++i) {
    double level = 0.01 * random.uniform(0.7, 1.3);
    for (const double clap : claps) {
      const double after = begin + 1e-3 * i - clap;
      if (after >= 0) level += 0.5 * std::exp(-after / 0.02);
    }
    sound.levels.push_back(static_cast<float>(level));
  }
  return sound;
}

std::optional<SoundOffset> heard(const SoundTrack& a, const SoundTrack& b) {
  return match_sounds(std::vector{a, b}, 0)[1];
}

TEST(SoundMatch, OneClapSaysHowMuchLaterAClipBeganWithItsOwnError) {
  const auto found = heard(clapped({2.5}), clapped({1.2}, 2, -0.3));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->later.value(), 1.3, 0.003);
  EXPECT_GE(found->sigma, milliseconds(20));
  EXPECT_EQ(sudden_sounds(clapped({1, 2, 2.05})).size(), 2U) << "an echo is no clap";
}

TEST(SoundMatch, SeveralClapsFitInOnePlaceAndEvenOnesInNone) {
  const auto odd = heard(clapped({1, 1.7, 3.1}), clapped({0.4, 1.1, 2.5, 4}, 2));
  ASSERT_TRUE(odd);
  EXPECT_NEAR(odd->later.value(), 0.6, 0.003);
  EXPECT_FALSE(heard(clapped({1, 2, 3, 4, 5}), clapped({0.5, 1.5, 2.5, 3.5, 4.5, 5.5}, 2)));
}

TEST(SoundMatch, OtherNoisesOrSilenceSayNothing) {
  EXPECT_FALSE(heard(clapped({1, 2.2}), clapped({1.4, 4}, 2)));
  EXPECT_FALSE(heard(clapped({1}), clapped({}, 2)));
  EXPECT_FALSE(heard(clapped({1}), {}));
  EXPECT_FALSE(heard({}, {}));
}

}  // namespace
}  // namespace emberlock::smear
