// SPDX-License-Identifier: Apache-2.0
#include "report/viewer_page.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace emberlock::report {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Not multiples of a brick's edge.
const recon::Grid kGrid{{-0.1F, 0.2F, 0.3F}, 0.01F, 11, 19, 9};

/// Values of all sizes and both signs in a corner, zeros elsewhere.
recon::SharedGrid corner(std::size_t lanes, float largest) {
  recon::SharedGrid grid{"emission", "unit", "", std::vector<float>(lanes * kGrid.size())};
  std::uint64_t n = 0;
  for (int k = 0; k < 5; ++k)
    for (int j = 9; j < 19; ++j)
      for (int i = 6; i < 11; ++i)
        for (std::size_t c = 0; c < lanes; ++c) {
          const auto bits = static_cast<double>((++n * 0x9E3779B97F4A7C15U) >> 40U) / 0x1p24;
          grid.values[lanes * kGrid.index(i, j, k) + c] =
              largest * static_cast<float>(std::exp2(-30 * bits) * (n % 2 == 0 ? 1 : -1));
        }
  grid.values[lanes * kGrid.index(8, 12, 2)] = largest;
  grid.values[lanes * kGrid.index(8, 13, 2)] = -0.0F;
  return grid;
}

float of_half(std::uint32_t bits) {
  const int exponent = static_cast<int>(bits >> 10 & 31U);
  const auto fraction = static_cast<double>(bits & 1023U);
  const double size =
      exponent == 0 ? std::ldexp(fraction, -24) : std::ldexp(1 + fraction / 1024, exponent - 15);
  return static_cast<float>((bits & 0x8000U) != 0 ? -size : size);
}

/// What the header says of the format, read backwards: one value after the other.
std::vector<float> unpacked(const PackedGrid& from, std::size_t lanes, Stored stored) {
  const auto byte = [&](std::size_t at) {
    return static_cast<std::uint32_t>(static_cast<unsigned char>(from.bytes[at]));
  };
  const int bx = (kGrid.nx + 7) / 8, by = (kGrid.ny + 7) / 8, bz = (kGrid.nz + 7) / 8;
  const auto bricks = static_cast<std::size_t>(bx * by * bz);
  const std::size_t mask = (bricks + 7) / 8;
  const std::size_t width = stored == Stored::half ? 2 : 4;
  const std::size_t count = (from.bytes.size() - mask) / width;
  std::vector<float> values(lanes * kGrid.size());
  std::size_t filled = 0;
  for (std::size_t brick = 0; brick < bricks; ++brick) {
    if ((byte(brick / 8) >> brick % 8 & 1U) == 0) continue;
    for (std::size_t at = 0; at < 512 * lanes; ++at) {
      const auto point = static_cast<int>(at / lanes);
      const int n = static_cast<int>(brick);
      const int i = 8 * (n % bx) + point % 8;
      const int j = 8 * (n / bx % by) + point / 8 % 8;
      const int k = 8 * (n / (bx * by)) + point / 64;
      std::uint32_t word = 0;
      for (std::size_t plane = 0; plane < width; ++plane)
        word |= byte(mask + plane * count + 512 * lanes * filled + at) << 8 * plane;
      const bool inside = i < kGrid.nx && j < kGrid.ny && k < kGrid.nz;
      if (!inside) {
        EXPECT_EQ(word, 0U);
      }
      if (inside)
        values[lanes * kGrid.index(i, j, k) + at % lanes] =
            stored == Stored::half ? of_half(word) * static_cast<float>(from.scale)
                                   : std::bit_cast<float>(word);
    }
    ++filled;
  }
  EXPECT_EQ(filled * 512 * lanes, count);
  return values;
}

TEST(ViewerPage, Float32ComesBackToTheBit) {
  for (const std::size_t lanes : {1U, 3U}) {
    const recon::SharedGrid grid = corner(lanes, 3e5F);
    const auto bytes = packed(kGrid, grid, Stored::float32);
    ASSERT_TRUE(bytes.ok());
    const std::vector<float> back = unpacked(*bytes, lanes, Stored::float32);
    ASSERT_EQ(back.size(), grid.values.size());
    for (std::size_t p = 0; p < back.size(); ++p)
      ASSERT_EQ(std::bit_cast<std::uint32_t>(back[p]), std::bit_cast<std::uint32_t>(grid.values[p])) << p;
  }
}

TEST(ViewerPage, HalvesStayWithinTheirBounds) {
  for (const float largest : {3e-7F, 1.0F, 65536.0F, 4e9F}) {
    const recon::SharedGrid grid = corner(3, largest);
    const auto bytes = packed(kGrid, grid, Stored::half);
    ASSERT_TRUE(bytes.ok());
    const std::vector<float> back = unpacked(*bytes, 3, Stored::half);
    for (std::size_t p = 0; p < back.size(); ++p) {
      const double value = static_cast<double>(grid.values[p]);
      const double bound = std::max(0x1p-11 * std::abs(value), 0x1p-39 * static_cast<double>(largest));
      ASSERT_LE(std::abs(static_cast<double>(back[p]) - value), bound) << value << " of " << largest;
    }
  }
}

TEST(ViewerPage, WhatIsEmptyTakesNoRoom) {
  recon::SharedGrid dark{"density", "1/m", "", std::vector<float>(kGrid.size())};
  EXPECT_EQ(packed(kGrid, dark, Stored::float32)->bytes, std::string(2, '\0'));  // 2 x 3 x 2 bricks
  EXPECT_EQ(packed(kGrid, dark, Stored::half)->bytes.size(), 2U);
}

TEST(ViewerPage, GridsThatTellNothingAreLeftOut) {
  ViewerPage page("title", "input", Eigen::Vector3d::UnitZ(), Stored::half);
  recon::SharedVolume volume{kGrid, {corner(3, 1)}, {}};
  volume.grids.push_back({"density", "1/m", "", std::vector<float>(kGrid.size())});
  volume.grids.push_back({"temperature", "K", "", std::vector<float>(kGrid.size(), 1500)});
  ASSERT_TRUE(page.add_frame(volume).ok());
  EXPECT_THAT(page.html({}), Not(HasSubstr("density")));
  EXPECT_THAT(page.html({}), HasSubstr(R"("name":"temperature")"));
}

TEST(ViewerPage, RefusesWhatIsNotFiniteAndWhatDoesNotFit) {
  recon::SharedGrid grid = corner(1, 1);
  grid.values[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(packed(kGrid, grid, Stored::half).error().what, HasSubstr("finite"));
  grid.values.resize(kGrid.size() * 2);
  EXPECT_FALSE(packed(kGrid, grid, Stored::half).ok());
  ViewerPage page("title", "input", Eigen::Vector3d::UnitZ(), Stored::half);
  EXPECT_FALSE(page.add_frame({kGrid, {}, {}}).ok());
}

TEST(ViewerPage, EachFrameHasItsOwnViews) {
  ViewerPage page("title", "input", Eigen::Vector3d::UnitZ(), Stored::half);
  const recon::SharedVolume volume{kGrid, {corner(3, 1)}, {}};
  ASSERT_TRUE(page.add_frame(volume, {{{{1.5, 2, 3}}, "data:a", ""}}).ok());
  ASSERT_TRUE(page.add_frame(volume).ok());
  const std::string html = page.html({});
  EXPECT_THAT(html, HasSubstr(R"("views":[{"captured":"data:a","rendered":null,"rmse":[1.5,2.0,3.0]}])"));
  EXPECT_THAT(html, HasSubstr(R"("views":[])"));
}

TEST(ViewerPage, NamesCannotEndTheScriptsTheyStandIn) {
  ViewerPage page("</title><b>", "</script><b>", Eigen::Vector3d::UnitZ(), Stored::half);
  ASSERT_TRUE(page.add_frame({kGrid, {corner(3, 1)}, {}}).ok());
  page.add_camera({"</script><i>\xff", recon::ViewRole::held_out, {}});
  const std::string html = page.html({"const s = '</script>';", "p { content: '</style>'; }"});
  EXPECT_THAT(html, Not(HasSubstr("<b>")));
  EXPECT_THAT(html, Not(HasSubstr("<i>")));
  EXPECT_THAT(html, Not(HasSubstr("'</script>'")));
  EXPECT_THAT(html, Not(HasSubstr("'</style>'")));
  EXPECT_THAT(html, HasSubstr(R"("role":"held_out")"));
}

}  // namespace
}  // namespace emberlock::report
