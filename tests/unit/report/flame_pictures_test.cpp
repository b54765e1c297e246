// SPDX-License-Identifier: Apache-2.0
#include "report/flame_pictures.h"

#include <gtest/gtest.h>

#include "recon/preprocess/radiance.h"

namespace emberlock::report {
namespace {

recon::RadianceImage ramp(ImageSize size, float offset) {
  recon::RadianceImage image(size);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = static_cast<float>(i) + offset;
  return image;
}

TEST(FlamePictures, CropTakesTheBoxAndNothingElse) {
  const Image image = recon::to_rgb8(ramp({12, 10}, 0));
  const Image part = crop(image, {2, 1, 4, 3});
  EXPECT_EQ(part.layout().size, (ImageSize{2, 2}));
  EXPECT_EQ(part.view().sample(0, 0, 0), 3 * (12 + 2));
  EXPECT_EQ(part.view().sample(1, 1, 2), image.view().sample(3, 2, 2));
  EXPECT_EQ(crop(image, {}), image);
}

TEST(FlamePictures, DifferenceHasNoSign) {
  const recon::RadianceImage d = difference(ramp({3, 3}, 0), ramp({3, 3}, 5), 4);
  EXPECT_EQ(d.rgb[7], 20);
  EXPECT_EQ(d.rgb, difference(ramp({3, 3}, 5), ramp({3, 3}, 0), 4).rgb);
}

TEST(FlamePictures, SideBySideKeepsEveryPicture) {
  const Image a = recon::to_rgb8(ramp({2, 2}, 1));
  const Image joined = side_by_side({a, a}, 3);
  EXPECT_EQ(joined.layout().size, (ImageSize{7, 2}));
  EXPECT_EQ(joined.view().sample(6, 1, 2), a.view().sample(1, 1, 2));
  EXPECT_EQ(joined.view().sample(3, 0, 0), 0);
}

TEST(FlamePictures, ScalingDownKeepsShapeAndMean) {
  recon::RadianceImage image({4, 2});
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = i / 3 % 4 < 2 ? 40.0F : 80.0F;
  const Image half = scaled(recon::to_rgb8(image), 2);
  EXPECT_EQ(half.layout().size, (ImageSize{2, 1}));
  EXPECT_EQ(half.view().sample(0, 0, 1), 40);
  EXPECT_EQ(half.view().sample(1, 0, 1), 80);
  EXPECT_EQ(scaled(recon::to_rgb8(image), 1).view().sample(0, 0, 2), 60);
}

TEST(FlamePictures, TallOnesAreNoTallerThanThereIsRoom) {
  const Image tall = recon::to_rgb8(ramp({10, 80}, 0));
  EXPECT_EQ(scaled_into(tall, {300, 400}).layout().size, (ImageSize{50, 400}));
  EXPECT_EQ(scaled_into(recon::to_rgb8(ramp({80, 10}, 0)), {300, 400}).layout().size, (ImageSize{300, 37}));
  EXPECT_EQ(enlarged(tall, {300, 400}).layout().size, (ImageSize{50, 400}));
  EXPECT_EQ(enlarged(tall, {300, 239}).layout().size, (ImageSize{20, 160})) << "whole times";
  EXPECT_EQ(enlarged(tall, {300, 20}).layout().size, tall.layout().size) << "never smaller";
}

TEST(FlamePictures, MarginStaysInsideThePicture) {
  const recon::PixelBox box = with_margin({1, 5, 3, 9}, 4, {10, 10});
  EXPECT_EQ(box.x0, 0);
  EXPECT_EQ(box.y0, 1);
  EXPECT_EQ(box.x1, 7);
  EXPECT_EQ(box.y1, 10);
}

}  // namespace
}  // namespace emberlock::report
