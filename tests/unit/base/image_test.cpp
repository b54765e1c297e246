// SPDX-License-Identifier: Apache-2.0
#include "base/image.h"

#include <gtest/gtest.h>

namespace emberlock {
namespace {

TEST(Image, CopyOfAStridedViewIsPacked) {
  std::vector<std::byte> padded(2 * 8);
  for (std::size_t i = 0; i < padded.size(); ++i) padded[i] = static_cast<std::byte>(i);
  const ImageView view{{{3, 2}, PixelFormat::gray8, 8}, padded.data(), 8};
  const Image copy(view);
  EXPECT_EQ(copy.bytes().size(), 6U);
  EXPECT_EQ(copy.view().sample(2, 1), 10);
}

TEST(Image, SixteenBitColourSamplesAreFoundByChannel) {
  Image image({{2, 1}, PixelFormat::rgb16, 12});
  image.row_as<std::uint16_t>(0)[3 + 1] = 4095;
  EXPECT_EQ(image.view().sample(1, 0, 1), 4095);
  EXPECT_EQ(image.layout().white(), 4095);
  EXPECT_EQ(image.layout().row_bytes(), 12U);
}

}  // namespace
}  // namespace emberlock
