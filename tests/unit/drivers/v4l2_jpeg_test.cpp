// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "drivers/v4l2/jpeg.h"

namespace emberlock::drivers {
namespace {

constexpr ImageSize kSize{64, 48};

/// Rows of rising red, as a JPEG.
std::vector<std::byte> rising_red() {
  cv::Mat bgr(kSize.height, kSize.width, CV_8UC3);
  for (int y = 0; y < kSize.height; ++y) bgr.row(y).setTo(cv::Scalar(10, 20, 5 * y));
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", bgr, bytes, {cv::IMWRITE_JPEG_QUALITY, 95});
  const auto* const begin = reinterpret_cast<const std::byte*>(bytes.data());
  return {begin, begin + bytes.size()};
}

TEST(V4l2Jpeg, IsAPictureInRedGreenBlue) {
  const auto decoded = decode_jpeg(rising_red(), kSize);
  EXPECT_EQ(decoded.status, FrameStatus::complete);
  ASSERT_EQ(decoded.image.layout(), (ImageLayout{kSize, PixelFormat::rgb8, 8}));
  for (int y = 0; y < kSize.height; ++y) {
    EXPECT_NEAR(decoded.image.view().sample(32, y, 0), 5 * y, 6) << y;
    EXPECT_NEAR(decoded.image.view().sample(32, y, 2), 10, 6) << y;
  }
}

TEST(V4l2Jpeg, CutShortIsDamaged) {
  auto bytes = rising_red();
  for (const std::size_t left : {bytes.size() - 2, bytes.size() / 2, std::size_t{20}, std::size_t{0}}) {
    bytes.resize(left);
    EXPECT_EQ(decode_jpeg(bytes, kSize).status, FrameStatus::damaged) << left;
  }
}

TEST(V4l2Jpeg, OfAnotherSizeIsDamaged) {
  EXPECT_EQ(decode_jpeg(rising_red(), {48, 64}).status, FrameStatus::damaged);
}

TEST(V4l2Jpeg, OfNonsenseIsDamagedAndBlack) {
  const std::vector<std::byte> nonsense(1000, std::byte{0x5a});
  const auto decoded = decode_jpeg(nonsense, kSize);
  EXPECT_EQ(decoded.status, FrameStatus::damaged);
  EXPECT_EQ(decoded.image, Image(ImageLayout{kSize, PixelFormat::rgb8, 8}));
}

}  // namespace
}  // namespace emberlock::drivers
