// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/glow_region.h"

#include <cmath>

#include <gmock/gmock.h>

#include "base/random.h"
#include "tests/support/pictures.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {
using testing::HasSubstr;

struct Shown {
  PatchPlace place;
  double level;
};

/// Rectangles on black, of noise 1; the later ones in front.
Image glow_picture(const std::vector<Shown>& shown, double slope = 0) {
  return image_of({{192, 144}, PixelFormat::rgb8, 8}, [&](int x, int y, int c) {
    double level = 2;
    for (const Shown& s : shown)
      if (x >= s.place.x && y >= s.place.y && x < s.place.x + s.place.width && y < s.place.y + s.place.height)
        level = s.level * (1 + slope * (x - s.place.x) / s.place.width);
    const auto i = static_cast<std::size_t>((y * 192 + x) * 3 + c);
    return std::clamp(std::round(level / (1 + c) + random_normal(3, 4, i)), 0.0, 255.0);
  });
}

TEST(GlowRegion, TheBrightestEvenPartIsFoundBesideAReflection) {
  const Image picture =
      glow_picture({{{10, 10, 60, 40}, 60}, {{90, 30, 50, 80}, 180}, {{20, 100, 3, 3}, 250}});
  const auto glow = value_of(read_glow(picture.view(), {}, "a.png"));
  EXPECT_GE(glow.region.x, 90);
  EXPECT_GE(glow.region.y, 30);
  EXPECT_LE(glow.region.x + glow.region.width, 140);
  EXPECT_LE(glow.region.y + glow.region.height, 110);
  EXPECT_GT(glow.region.width * glow.region.height, 3000);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(glow.level[c], 180.0 / static_cast<double>(1 + c), 0.1);
    EXPECT_LT(glow.sigma[c], 0.1);
    EXPECT_FALSE(glow.saturated[c]);
  }
}

TEST(GlowRegion, AToldRegionIsReadAndAnUnevenOneIsLessSure) {
  const std::vector<Shown> shown = {{{90, 30, 50, 80}, 150}};
  GlowPictureOptions options;
  options.region = PatchPlace{95, 35, 40, 70};
  const auto even = value_of(read_glow(glow_picture(shown).view(), options, "a.png"));
  const auto slope = value_of(read_glow(glow_picture(shown, 0.2).view(), options, "a.png"));
  EXPECT_GT(slope.sigma[0], 20 * even.sigma[0]);
  for (const PatchPlace bad : {PatchPlace{-1, 0, 9, 9}, PatchPlace{190, 0, 9, 9}, PatchPlace{0, 0, 1, 9},
                               PatchPlace{0, 0, 0, 0}, PatchPlace{2147483647, 0, 2147483647, 9}}) {
    options.region = bad;
    EXPECT_THAT(read_glow(glow_picture(shown).view(), options, "a.png"), FailsWith("a.png"));
  }
}

TEST(GlowRegion, WhiteIsABoundAndDarkIsTakenOff) {
  GlowPictureOptions options;
  const Image dark = glow_picture({{{0, 0, 192, 144}, 12}});
  options.dark = &dark;
  const auto glow = value_of(read_glow(glow_picture({{{60, 30, 60, 60}, 400}}).view(), options, "a.png"));
  EXPECT_TRUE(glow.saturated[0]);
  EXPECT_FALSE(glow.saturated[1]);
  EXPECT_NEAR(glow.level[1], 200 - 6, 0.2);
  Image other(ImageLayout{{64, 64}, PixelFormat::rgb8, 8});
  EXPECT_THAT(read_glow(other.view(), options, "a.png"), FailsWith("dark picture"));
}

TEST(GlowRegion, NoiseThatIsCutAtBlackIsNoLight) {
  GlowPictureOptions options;
  options.region = PatchPlace{20, 20, 100, 100};
  const auto glow = value_of(read_glow(glow_picture({{{0, 0, 192, 144}, 0}}).view(), options, "a.png"));
  EXPECT_GT(glow.level[0], 0.3);
  EXPECT_LT(glow.level[0], 3 * glow.sigma[0]);
}

TEST(GlowRegion, TheColourOfTheCameraIsApplied) {
  GlowPictureOptions options;
  Colour colour;
  for (int i = 0; i <= 255; ++i) colour.response.push_back(std::pow(i / 255.0, 2));
  colour.gain = {2, 1, 1};
  options.colour = colour;
  const auto glow = value_of(read_glow(glow_picture({{{60, 30, 60, 60}, 100}}).view(), options, "a.png"));
  EXPECT_NEAR(glow.level[0], 2 * 255 * std::pow(100 / 255.0, 2), 0.3);
}

TEST(GlowRegion, ABlackPictureAndAPointHaveNone) {
  Image black(ImageLayout{{192, 144}, PixelFormat::gray8, 8});
  EXPECT_THAT(read_glow(black.view(), {}, "a.png"), FailsWith("no even bright region"));
  EXPECT_THAT(read_glow(black.view(), {}, "a.png").error().remedy, HasSubstr("--region"));
  black.row_as<std::uint8_t>(70)[90] = 255;
  EXPECT_FALSE(read_glow(black.view(), {}, "a.png").ok());
  Image one(ImageLayout{{1, 1}, PixelFormat::gray8, 8});
  EXPECT_FALSE(read_glow(one.view(), {}, "a.png").ok());
}

}  // namespace
}  // namespace emberlock::recon
