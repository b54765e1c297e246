// SPDX-License-Identifier: Apache-2.0
#include "apply/live_flame.h"

#include <algorithm>

#include <gmock/gmock.h>

#include "recon/export/volume_file.h"
#include "tests/support/marker_film.h"
#include "tests/support/recording.h"
#include "tests/support/small_scene.h"

namespace emberlock::apply {
namespace {
namespace fs = std::filesystem;

constexpr ImageSize kLive{240, 180};

/// A cube of light on a marker before a camera in a hand.
class LiveFlameTest : public testing::Test {
 protected:
  LiveFlameTest() {
    scene_.marker = test::usual_marker();
    scene_.lens = {kLive, 240, 240, 119, 91, {}};
    scene_.flame.placed.result = temp_.path();
    scene_.flame.placed.world_from_flame.scale = 0.3;
    scene_.flame.plate = 0.5;
    const recon::Volume volume =
        test::volume_of({{-0.1F, -0.1F, 0.1F}, 0.02F, 11, 11, 11}, [](int i, int j, int k) {
          const bool inside = std::max({std::abs(i - 5), std::abs(j - 5), std::abs(k - 5)}) < 4;
          return std::array<float, 4>{inside ? 2000.0F : 0, inside ? 1000.0F : 0, 0, 0};
        });
    if (!recon::write_volume(volume, temp_ / "volume.vdb").ok()) ADD_FAILURE() << "no volume";
  }
  [[nodiscard]] recon::CameraModel hand(int frame) const {
    return test::in_a_hand(scene_.lens, frame / 30.0, 0.5);
  }
  [[nodiscard]] Image filmed(int frame, bool hidden = false) const {
    test::PlateLook look;
    look.samples = 3;
    look.hidden = hidden;
    return plate_.seen_by(hand(frame), look);
  }
  /// Red where the cube's middle is.
  [[nodiscard]] int red(const Image& picture, int frame) const {
    const Eigen::Vector2d at = hand(frame).project({0, 0, 0.021});
    return picture.view().sample(static_cast<int>(at.x()), static_cast<int>(at.y()), 0);
  }

  test::TempFolder temp_;
  LiveScene scene_;
  test::Plate plate_{test::usual_marker()};
  recon::Pool pool_{2};
};

TEST_F(LiveFlameTest, TheFlameFollowsTheMarkerIsHeldAndGoes) {
  auto live = LiveFlame::load(scene_, pool_);
  ASSERT_TRUE(live.ok()) << live.error().message();
  for (int f = 0; f < 30; ++f) {
    const bool hidden = f >= 10;
    const Image bare = filmed(f, hidden);
    Image picture = bare;
    const auto seen = live->draw(Seconds(f / 30.0), picture, pool_);
    ASSERT_TRUE(seen.ok());
    EXPECT_EQ(seen->without, std::max(0, f - 9)) << f;
    if (f < 10) {
      EXPECT_EQ(seen->pose.from, TrackedPose::From::marker);
    }
    if (f < 15) {
      EXPECT_GT(red(picture, f), 200) << f << " found, or held for five frames";
    } else {
      EXPECT_EQ(seen->pose.from, TrackedPose::From::nothing);
      EXPECT_EQ(picture.bytes(), bare.bytes()) << "as it was filmed";
      EXPECT_EQ(seen->instead, "") << "there is no other either";
    }
  }
}

TEST_F(LiveFlameTest, AMarkerOfAnotherDictionaryIsNamed) {
  scene_.marker = parse_marker("aruco:5X5_50:7:80mm").value();
  auto live = LiveFlame::load(scene_, pool_);
  ASSERT_TRUE(live.ok());
  std::string instead;
  for (int f = 0; f < 16; ++f) {
    Image picture = filmed(f);
    instead = live->draw(Seconds(f / 30.0), picture, pool_)->instead;
  }
  EXPECT_EQ(instead, "a marker of 4X4_50, number 7");
}

TEST_F(LiveFlameTest, AResultWithoutAVolumeIsRefused) {
  fs::remove(temp_ / "volume.vdb");
  EXPECT_EQ(LiveFlame::load(scene_, pool_).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace emberlock::apply
