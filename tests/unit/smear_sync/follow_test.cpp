// SPDX-License-Identifier: Apache-2.0
// Reading frame after frame: the same as reading each alone, and nothing new goes unseen.
#include "smear_sync/detect/follow.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/smear_frames.h"

namespace emberlock::smear {
namespace {

using test::SmearScene;

constexpr double kFollowedX = 161.3;
constexpr double kFollowedY = 200.4;

SmearScene followed_scene() { return SmearScene(320, 360).disk(kFollowedX, kFollowedY, 4, 3000); }

TEST(Follow, EveryFrameReadsAsItDoesAlone) {
  FollowingDetector detector;
  for (std::uint64_t i = 0; i < 150; ++i) {
    SmearScene scene = followed_scene();
    const double row = 20 + static_cast<double>(i);
    if (std::abs(row - kFollowedY) > 20 && i % 5 != 0) scene.disk(kFollowedX, row, 4, 15);
    const Image image = scene.image({.seed = i});
    const SmearReading followed = detector.read(image.view());
    const SmearReading alone = detect(image.view());
    ASSERT_EQ(followed.state, alone.state)
        << "frame " << i << ": " << followed.reason << " / " << alone.reason;
    ASSERT_EQ(followed.dots.size(), alone.dots.size());
    for (std::size_t d = 0; d < alone.dots.size(); ++d)
      EXPECT_NEAR(followed.dots[d].y.value(), alone.dots[d].y.value(), 0.02);
  }
}

TEST(Follow, TheLampGoesOutAndComesBackElsewhere) {
  FollowingDetector detector;
  const Image lit = followed_scene().image({});
  const Image dark = SmearScene(320, 360).image({});
  const Image moved = SmearScene(320, 360).disk(80.2, 120.1, 4, 3000).disk(80.2, 180.1, 4, 20).image({});
  EXPECT_EQ(detector.read(lit.view()).state, SmearState::no_dot);
  EXPECT_EQ(detector.read(dark.view()).state, SmearState::no_lamp);
  EXPECT_EQ(detector.read(lit.view()).state, SmearState::no_dot);
  const SmearReading r = detector.read(moved.view());
  ASSERT_EQ(r.state, SmearState::dot) << r.reason;
  EXPECT_NEAR(r.dots[0].y.value(), 180.1, 0.2);
}

TEST(Follow, ASaturatedLampIsMeasuredAgainOnceItMovesByAFractionOfAPixel) {
  FollowingDetector detector;
  const auto with_dot = [] { return followed_scene().disk(kFollowedX, 300, 4, 20); };
  const Rows before = detector.read(with_dot().image({.seed = 1}).view()).lamp->y;
  EXPECT_EQ(detector.read(with_dot().image({.seed = 2}).view()).lamp->y, before);
  const Image moved = SmearScene(320, 360).disk(kFollowedX, kFollowedY + 0.3, 4, 3000).image({.seed = 3});
  EXPECT_EQ(detector.read(moved.view()).lamp->y, detect(moved.view()).lamp->y);
}

// The dot may stand in the lamp's bloom and bend its outline.
TEST(Follow, ASaturatedLampWithoutItsDotIsMeasuredAgain) {
  FollowingDetector detector;
  for (const std::uint64_t seed : {1, 2}) {
    const Image image = followed_scene().image({.seed = seed});
    EXPECT_EQ(detector.read(image.view()).lamp->y, detect(image.view()).lamp->y);
  }
}

TEST(Follow, AReflectionThatAppearsInTheLampsColumnIsNoDot) {
  FollowingDetector detector;
  EXPECT_EQ(detector.read(followed_scene().image({}).view()).state, SmearState::no_dot);
  const Image image = followed_scene().disk(kFollowedX, 280.3, 4, 3000).image({});
  const SmearReading r = detector.read(image.view());
  EXPECT_EQ(r.state, SmearState::ambiguous) << r.reason;
  EXPECT_TRUE(r.dots.empty());
}

TEST(Follow, ASecondLampInAnotherColumnIsSeenWithinSixteenFrames) {
  FollowingDetector detector;
  detector.read(followed_scene().image({}).view());
  // With another dot than the first one's: the two disagree.
  const Image image = followed_scene()
                          .disk(kFollowedX, 280.4, 4, 20)
                          .disk(60.4, 90.2, 4, 3000)
                          .disk(60.4, 140.2, 4, 20)
                          .image({});
  SmearState state = SmearState::dot;
  for (int i = 0; i < 16 && state != SmearState::ambiguous; ++i) state = detector.read(image.view()).state;
  EXPECT_EQ(state, SmearState::ambiguous);
}

TEST(Follow, OtherFormatsAndMalformedFramesBetween) {
  FollowingDetector detector;
  const SmearScene scene = followed_scene().disk(kFollowedX, 280.4, 4, 20);
  EXPECT_EQ(detector.read(scene.image({}).view()).state, SmearState::dot);
  EXPECT_EQ(detector.read(ImageView{}).state, SmearState::no_lamp);
  for (const PixelFormat format : {PixelFormat::bayer_rggb8, PixelFormat::rgb8, PixelFormat::gray8}) {
    for (std::uint64_t i = 0; i < 3; ++i)
      EXPECT_EQ(detector.read(scene.image({.seed = i, .format = format}).view()).state, SmearState::dot);
  }
}

}  // namespace
}  // namespace emberlock::smear
