// SPDX-License-Identifier: Apache-2.0
#include "drivers/unpack.h"

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace emberlock::drivers {
namespace {

/// Bits of a row, least significant first, as PFNC's "p" packings define them.
class BitRow {
 public:
  void put(unsigned value, int bits) {
    for (int i = 0; i < bits; ++i, ++size_) {
      if (size_ % 8 == 0) bytes_.push_back(std::byte{0});
      if (value >> i & 1U) bytes_.back() |= std::byte{1} << size_ % 8;
    }
  }
  [[nodiscard]] const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
  int size_ = 0;
};

std::vector<unsigned> random_samples(int count, int depth) {
  std::mt19937 random(7);
  std::vector<unsigned> samples;
  for (int i = 0; i < count; ++i) samples.push_back(static_cast<unsigned>(random()) % (1U << depth));
  return samples;
}

void expect_samples(const Image& image, const std::vector<unsigned>& samples) {
  const ImageView view = image.view();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(view.sample(static_cast<int>(i) % view.width(), static_cast<int>(i) / view.width()), samples[i])
        << i;
  }
}

TEST(Unpack, SamplesPackedBitByBitComeOutAsTheyWerePut) {
  const auto ten = random_samples(24, 10);
  const auto twelve = random_samples(24, 12);
  BitRow row10;
  BitRow row12;
  for (const unsigned s : ten) row10.put(s, 10);
  for (const unsigned s : twelve) row12.put(s, 12);
  const PackedPixels as10{{8, 3}, PixelPacking::gray10_packed};
  const PackedPixels as12{{8, 3}, PixelPacking::gray12_packed};
  expect_samples(unpack(as10, row10.bytes(), row_bytes(as10)).value(), ten);
  expect_samples(unpack(as12, row12.bytes(), row_bytes(as12)).value(), twelve);
  EXPECT_EQ(layout_of(as10)->bit_depth, 10);
  EXPECT_EQ(layout_of(as12)->white(), 4095);
}

TEST(Unpack, HighBytesBesideLowBits) {
  const auto twelve = random_samples(8, 12);
  std::vector<std::byte> gev;
  for (std::size_t i = 0; i < twelve.size(); i += 2) {
    gev.push_back(static_cast<std::byte>(twelve[i] >> 4));
    gev.push_back(static_cast<std::byte>((twelve[i] & 15U) | (twelve[i + 1] & 15U) << 4));
    gev.push_back(static_cast<std::byte>(twelve[i + 1] >> 4));
  }
  expect_samples(unpack({{4, 2}, PixelPacking::gray12_gev_packed}, gev, 6).value(), twelve);

  const auto ten = random_samples(8, 10);
  std::vector<std::byte> mipi;
  for (std::size_t i = 0; i < ten.size(); i += 4) {
    unsigned low = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      mipi.push_back(static_cast<std::byte>(ten[i + k] >> 2));
      low |= (ten[i + k] & 3U) << 2 * k;
    }
    mipi.push_back(static_cast<std::byte>(low));
  }
  expect_samples(unpack({{4, 2}, PixelPacking::gray10_mipi}, mipi, 5).value(), ten);
}

TEST(Unpack, SamplesOfSixteenBitsLoseWhatLiesAboveTheirDepth) {
  const std::vector<std::byte> bytes{std::byte{0xff}, std::byte{0xff}, std::byte{0x34}, std::byte{0x02}};
  const Image image = unpack({{2, 1}, PixelPacking::gray12}, bytes, 4).value();
  expect_samples(image, {0xfff, 0x234});
}

TEST(Unpack, AMosaicBeginsWithRedWhateverTheCameraBeginsWith) {
  // The mosaic's colours as numbers: red 1, green 2, blue 3.
  const auto colour = [](BayerPhase phase, int x, int y) {
    const int px = (x + (phase == BayerPhase::grbg || phase == BayerPhase::bggr ? 1 : 0)) % 2;
    const int py = (y + (phase == BayerPhase::gbrg || phase == BayerPhase::bggr ? 1 : 0)) % 2;
    return px == 0 && py == 0 ? 1 : px == 1 && py == 1 ? 3 : 2;
  };
  for (const BayerPhase phase : {BayerPhase::rggb, BayerPhase::grbg, BayerPhase::gbrg, BayerPhase::bggr}) {
    std::vector<std::byte> bytes;
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 8; ++x) bytes.push_back(static_cast<std::byte>(colour(phase, x, y) + 10 * (x / 2)));
    }
    const Image image = unpack({{8, 6}, PixelPacking::bayer8, phase}, bytes, 8).value();
    EXPECT_EQ(image.layout().format, PixelFormat::bayer_rggb8);
    EXPECT_EQ(image.layout().size.width % 2, 0);
    EXPECT_EQ(image.layout().size.height % 2, 0);
    for (int y = 0; y < image.layout().size.height; ++y) {
      for (int x = 0; x < image.layout().size.width; ++x) {
        EXPECT_EQ(image.view().sample(x, y) % 10, colour(BayerPhase::rggb, x, y)) << x << ' ' << y;
      }
    }
  }
}

TEST(Unpack, ChromaMakesTheColoursOfBt601) {
  // A colour to limited-range YCbCr by the standard's own equations, and back.
  for (const auto& [r, g, b] : std::vector<std::array<double, 3>>{
           {0, 0, 0}, {255, 255, 255}, {255, 0, 0}, {0, 255, 0}, {0, 0, 255}, {200, 120, 40}}) {
    const double luma = .299 * r + .587 * g + .114 * b;
    const auto y = static_cast<std::byte>(std::lround(16 + luma * 219 / 255));
    const auto u = static_cast<std::byte>(std::lround(128 + (b - luma) / 1.772 * 224 / 255));
    const auto v = static_cast<std::byte>(std::lround(128 + (r - luma) / 1.402 * 224 / 255));
    const Image yuyv = unpack({{2, 1}, PixelPacking::yuyv}, std::vector{y, u, y, v}, 4).value();
    const Image uyvy = unpack({{2, 1}, PixelPacking::uyvy}, std::vector{u, y, v, y}, 4).value();
    EXPECT_EQ(yuyv, uyvy);
    for (const int x : {0, 1}) {
      EXPECT_NEAR(yuyv.view().sample(x, 0, 0), r, 2);
      EXPECT_NEAR(yuyv.view().sample(x, 0, 1), g, 2);
      EXPECT_NEAR(yuyv.view().sample(x, 0, 2), b, 2);
    }
  }
}

TEST(Unpack, RowsWithGapsBetweenThem) {
  const std::vector<std::byte> bytes{std::byte{1}, std::byte{2}, std::byte{9}, std::byte{3}, std::byte{4}};
  expect_samples(unpack({{2, 2}, PixelPacking::gray8}, bytes, 3).value(), {1, 2, 3, 4});
  const std::vector<std::byte> bgr{std::byte{1}, std::byte{2}, std::byte{3}};
  EXPECT_EQ(unpack({{1, 1}, PixelPacking::bgr8}, bgr, 3)->view().sample(0, 0, 0), 3);
}

TEST(Unpack, TooFewBytesOrImpossibleSidesAreRefused) {
  const std::vector<std::byte> bytes(12);
  EXPECT_TRUE(unpack({{4, 3}, PixelPacking::gray8}, bytes, 4).ok());
  EXPECT_FALSE(unpack({{4, 4}, PixelPacking::gray8}, bytes, 4).ok());
  EXPECT_FALSE(unpack({{4, 3}, PixelPacking::gray8}, bytes, 3).ok());
  EXPECT_FALSE(unpack({{4, 3}, PixelPacking::gray8}, {}, 4).ok());
  EXPECT_FALSE(layout_of({{3, 2}, PixelPacking::yuyv}).ok());
  EXPECT_FALSE(layout_of({{0, 2}, PixelPacking::gray8}).ok());
  EXPECT_FALSE(layout_of({{1 << 20, 2}, PixelPacking::gray8}).ok());
  EXPECT_FALSE(layout_of({{2, 2}, PixelPacking::bayer8, BayerPhase::bggr}).ok());
}

}  // namespace
}  // namespace emberlock::drivers
