// SPDX-License-Identifier: Apache-2.0
// A pass of the virtual CCD that a scene doesn't list costs no instructions: its pictures against ones drawn
// by a program that never heard of passes, counted by valgrind's callgrind.
#include <gtest/gtest.h>

#include "tests/integration/cost/callgrind.h"

namespace emberlock {
namespace {

double frame_of(const std::string& name) {
  return count_instructions(EMBERLOCK_COST_SENSOR, name).instructions;
}

TEST(SensorCost, APictureWithoutPassesIsItsBackgroundConvertedAndNoMore) {
  const double by_hand = frame_of("no_pass_by_hand");
  EXPECT_GT(by_hand, 1e5);
  const double listed = frame_of("no_pass");
  EXPECT_LE(listed / by_hand, 1.01);
  EXPECT_NEAR(frame_of("no_pass_of_wild_figures") / listed, 1, 0.001);
}

TEST(SensorCost, ReadNoiseAloneIsThatOfAProgramThatKnowsNothingElse) {
  const double by_hand = frame_of("read_noise_by_hand");
  EXPECT_LE(frame_of("read_noise") / by_hand, 1.01);
  EXPECT_GT(frame_of("both_noises") / by_hand, 1.05) << "what is on is seen to cost";
}

TEST(SensorCost, EachPassThatIsListedIsSeenToCost) {
  const double none = frame_of("no_pass");
  for (const char* pass : {"smear", "room", "hot_pixels", "quantise"})
    EXPECT_GT(frame_of(pass), 1.005 * none) << pass;
  const double smear = frame_of("smear");
  const double lamp = frame_of("lamp_and_smear");
  EXPECT_GT(lamp, smear);
  EXPECT_GT(frame_of("lamp_bloom_and_smear"), lamp);
}

}  // namespace
}  // namespace emberlock
