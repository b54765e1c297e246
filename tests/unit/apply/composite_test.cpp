// SPDX-License-Identifier: Apache-2.0
// A flame in frames of a plate: what it must do to them, by closed forms.
#include "apply/composite.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "recon/render/render.h"
#include "tests/support/marker_film.h"
#include "tests/support/small_scene.h"

namespace emberlock::apply {
namespace {

using test::before_plate;
using test::moved;
using test::spark;
using test::uneven;
using test::usual_marker;
using test::volume_of;

recon::Intrinsics small_lens(const recon::Distortion& distortion = {}) {
  return {{96, 72}, 90, 90, 48, 36, distortion};
}

class CompositeTest : public testing::Test {
 protected:
  Flame flame(recon::Volume volume, const Placement& place = {}) {
    return Flame({std::move(volume)}, place, 1, 16, pool_);
  }
  /// An even frame.
  static Image even(std::uint8_t level) {
    Image frame(ImageLayout{small_lens().size, PixelFormat::rgb8, 8});
    std::fill(frame.bytes().begin(), frame.bytes().end(), std::byte{level});
    return frame;
  }
  static int level(const Image& frame, int x, int y, int c = 0) { return frame.view().sample(x, y, c); }
  Image drawn(const Flame& what, const recon::CameraModel& camera, Image frame, const InFront& front = {},
              double plane = 0, double shown = 1, Transfer::Curve curve = Transfer::Curve::linear) {
    Composite composite(camera.intrinsics, usual_marker(), curve);
    const PlateLight light = plane > 0 ? PlateLight(what, plane, 65, pool_) : PlateLight();
    composite.take_white(frame, camera.camera_from_world);
    composite.draw(what, light, camera.camera_from_world, front, shown, frame, pool_);
    return frame;
  }
  static bool same(const Image& a, const Image& b) {
    return std::equal(a.bytes().begin(), a.bytes().end(), b.bytes().begin(), b.bytes().end());
  }

  recon::Pool pool_{2};
  recon::Volume cloud_ =
      volume_of({{-0.08F, -0.08F, 0.02F}, 0.02F, 9, 9, 9}, [v = uneven(1, 600, 8)](int i, int j, int k) {
        const bool rim = std::min({i, j, k, 8 - i, 8 - j, 8 - k}) == 0;
        return rim ? std::array<float, 4>{} : v(i, j, k);
      });
  recon::CameraModel camera_ = before_plate(small_lens(), {0.1, -0.5, 0.4}, {0, 0, 0.08});
};

TEST_F(CompositeTest, LevelsTurnIntoLightAndBack) {
  for (const auto curve : {Transfer::Curve::srgb, Transfer::Curve::linear}) {
    const Transfer transfer(curve);
    for (int i = 0; i < 256; ++i) {
      const auto level = static_cast<std::uint8_t>(i);
      EXPECT_EQ(transfer.level(transfer.light(level)), i);
    }
    EXPECT_EQ(transfer.level(-1), 0);
    EXPECT_EQ(transfer.level(std::nanf("")), 0);
    EXPECT_EQ(transfer.level(1e9F), 255);
  }
  EXPECT_NEAR(Transfer(Transfer::Curve::srgb).light(188) / 255, 0.503, 0.001);
}

TEST_F(CompositeTest, WithoutFlameAFrameKeepsItsBytes) {
  Image frame = even(0);
  for (std::size_t i = 0; i < frame.bytes().size(); ++i)
    frame.bytes()[i] = static_cast<std::byte>(random_bits(1, 2, i) & 255);
  const Flame none = flame(spark(0));
  EXPECT_TRUE(same(drawn(none, camera_, frame, {}, 1, 1, Transfer::Curve::srgb), frame));
  const Flame fire = flame(cloud_);
  EXPECT_TRUE(same(drawn(fire, camera_, frame, {}, 1, 0, Transfer::Curve::srgb), frame)) << "not shown";
  EXPECT_FALSE(same(drawn(fire, camera_, frame, {}, 1, 1, Transfer::Curve::srgb), frame));
}

/// Before a background it is what render shows: L + T B; also through a lens that bends.
TEST_F(CompositeTest, ItIsTheFlameOfRenderBeforeTheFrame) {
  const Flame fire = flame(cloud_);
  for (const recon::Distortion& bent : {recon::Distortion{}, recon::Distortion{-0.2, 0.05, 0, 0, 0}}) {
    const recon::CameraModel camera{small_lens(bent), camera_.camera_from_world};
    recon::Effects effects;
    effects.extinction.model = recon::Extinction::Model::field;
    const auto alone = recon::render_view(cloud_, recon::filled_voxels(cloud_), effects, camera);
    recon::Volume dark = cloud_;
    for (float& e : dark.emission) e = 0;
    recon::RenderOptions options;
    recon::RadianceImage white(camera.intrinsics.size);
    std::fill(white.rgb.begin(), white.rgb.end(), 1.0F);
    options.background = &white;
    effects.background.kind = recon::Background::Kind::image;
    const auto through = recon::render_view(dark, recon::filled_voxels(dark), effects, camera, options);
    const Image seen = drawn(fire, camera, even(60));
    int covered = 0;
    for (int y = 0; y < 72; ++y)
      for (int x = 0; x < 96; ++x)
        for (int c = 0; c < 3; ++c) {
          const auto i = static_cast<std::size_t>(3 * (y * 96 + x) + c);
          const double expected = std::min(255.0F, alone.rgb[i] + 60 * through.rgb[i]);
          ASSERT_NEAR(level(seen, x, y, c), expected, 0.51) << x << ' ' << y;
          covered += alone.rgb[i] > 1 ? 1 : 0;
        }
    EXPECT_GT(covered, 500);
  }
}

TEST_F(CompositeTest, AMaskHidesByItsShare) {
  const Flame fire = flame(cloud_);
  const Image before = even(60);
  const Image all = drawn(fire, camera_, before, {}, 1);
  InFront front;
  front.mask.assign(96 * 72, 0);
  for (std::size_t i = 0; i < front.mask.size(); ++i) {
    const std::size_t column = i % 96;
    front.mask[i] = static_cast<std::uint8_t>(column < 32 ? 0 : column < 64 ? 102 : 255);
  }
  const Image masked = drawn(fire, camera_, before, front, 1);
  for (int y = 0; y < 72; ++y)
    for (int x = 0; x < 96; ++x) {
      if (level(all, x, y) == 255) continue;
      const double share = x < 32 ? 1 : x < 64 ? 0.6 : 0;
      ASSERT_NEAR(level(masked, x, y), 60 + share * (level(all, x, y) - 60), 1) << x << ' ' << y;
    }
}

/// A wall in the middle of an even cube hides half of its light; one before it all, one behind it nothing,
/// and where the depth isn't known nothing either.
TEST_F(CompositeTest, ADepthPictureEndsTheFlame) {
  const Flame cube = flame(volume_of({{-0.2F, -0.2F, 0.1F}, 0.05F, 9, 9, 9}, [](int, int, int) {
    return std::array<float, 4>{200, 200, 200, 0};
  }));
  const recon::CameraModel above = before_plate(small_lens(), {0, 0, 2});
  const auto middle_with = [&](float depth) {
    InFront front;
    front.depth.assign(96 * 72, depth);
    return level(drawn(cube, above, even(0), front), 48, 36);
  };
  EXPECT_NEAR(middle_with(0), 80, 1);
  EXPECT_NEAR(middle_with(3), 80, 1);
  EXPECT_NEAR(middle_with(1.7F), 40, 1);
  EXPECT_NEAR(middle_with(1.6F), 20, 1);
  EXPECT_EQ(middle_with(1.2F), 0);
}

/// E = P h / r^3 of a small light at height h; the frame's white W shines B (1 + A E / (pi W)).
TEST_F(CompositeTest, ASparkLightsThePlateByInverseSquareAndCosine) {
  constexpr double kHeight = 0.3;
  const Flame light = flame(spark(8e6F), moved(0, 0, kHeight));
  const double power = 8e6 * 1e-6;
  const recon::CameraModel camera = before_plate(small_lens(), {0.05, -0.3, 0.25}, {0.02, 0.02, 0});
  const Image seen = drawn(light, camera, even(100), {}, 2);
  for (int y = 0; y < 72; y += 5)
    for (int x = 0; x < 96; x += 5) {
      const recon::Ray ray = camera.ray({x + 0.5, y + 0.5});
      const Eigen::Vector3d at = ray.origin - ray.origin.z() / ray.direction.z() * ray.direction;
      if (at.head<2>().norm() > 0.8) continue;
      const double r = (Eigen::Vector3d(0, 0, kHeight) - at).norm();
      const double added = 0.8 * power * kHeight / (r * r * r) / std::numbers::pi;
      ASSERT_NEAR(level(seen, x, y), 100 + added, 0.02 * added + 0.6) << x << ' ' << y;
    }
}

/// What an even cube that touches the plate sends there, against its integral by small boxes.
TEST_F(CompositeTest, LightOnThePlateIsRightUnderTheFlameToo) {
  const Flame cube = flame(volume_of({{-0.1F, -0.1F, 0}, 0.0125F, 17, 17, 17}, [](int, int, int) {
    return std::array<float, 4>{100, 100, 100, 0};
  }));
  const PlateLight light(cube, 1, 81, pool_);
  for (const double x : {0.0, 0.05, 0.1, 0.15, 0.3}) {
    constexpr int kBoxes = 100;
    double expected = 0;
    for (int i = 0; i < kBoxes; ++i)
      for (int j = 0; j < kBoxes; ++j)
        for (int k = 0; k < kBoxes; ++k) {
          constexpr double kSide = 0.2 / kBoxes;
          const Eigen::Vector3d to(-0.1 + (i + 0.5) * kSide - x, -0.1 + (j + 0.5) * kSide, (k + 0.5) * kSide);
          expected += 100 * to.z() / std::pow(to.norm(), 3) * kSide * kSide * kSide;
        }
    EXPECT_NEAR(light.at(static_cast<float>(x), 0).x(), expected, 0.04 * expected) << x;
  }
  EXPECT_EQ(light.at(0.6F, 0).x(), 0);
}

TEST_F(CompositeTest, TheSameForAnyNumberOfThreads) {
  const Flame fire = flame(cloud_);
  const Image two = drawn(fire, camera_, even(60), {}, 1);
  recon::Pool alone(1);
  Composite composite(small_lens(), usual_marker(), Transfer::Curve::linear);
  Image frame = even(60);
  composite.take_white(frame, camera_.camera_from_world);
  composite.draw(fire, PlateLight(fire, 1, 65, alone), camera_.camera_from_world, {}, 1, frame, alone);
  EXPECT_TRUE(same(frame, two));
}

}  // namespace
}  // namespace emberlock::apply
