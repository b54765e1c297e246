// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <regex>
#include <string>

#include <gmock/gmock.h>

#include "apply/marker.h"
#include "cli/commands.h"
#include "recon/calibrate/markers.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
using testing::HasSubstr;

class MarkerCommandTest : public testing::Test {
 protected:
  [[nodiscard]] test::VerbRun draw(const std::string& marker) const {
    return test::run_verb(add_marker, {"marker", marker, "--out", (temp_ / "marker.svg").string()});
  }
  /// The file as a picture, `scale` pixels for each of its units.
  [[nodiscard]] Image drawn(int scale) const {
    const std::string svg = test::bytes_of(temp_ / "marker.svg");
    std::smatch found;
    EXPECT_TRUE(std::regex_search(svg, found, std::regex("viewBox=\"0 0 (\\d+) (\\d+)\"")));
    Image image(
        ImageLayout{{scale * std::stoi(found[1]), scale * std::stoi(found[2])}, PixelFormat::gray8, 8});
    std::fill(image.bytes().begin(), image.bytes().end(), std::byte{255});
    const std::regex path("M(\\d+) (\\d+)H(\\d+)V(\\d+)H");
    for (auto at = std::sregex_iterator(svg.begin(), svg.end(), path); at != std::sregex_iterator(); ++at)
      for (int y = scale * std::stoi((*at)[2]); y < scale * std::stoi((*at)[4]); ++y)
        for (int x = scale * std::stoi((*at)[1]); x < scale * std::stoi((*at)[3]); ++x)
          image.row_as<std::uint8_t>(y)[x] = 0;
    return image;
  }
  test::TempFolder temp_;
};

TEST_F(MarkerCommandTest, WhatIsPrintedIsThatMarkerInItsSize) {
  ASSERT_EQ(draw("aruco:5X5_100:42:70mm").exit_code, 0);
  EXPECT_THAT(test::bytes_of(temp_ / "marker.svg"), HasSubstr("width=\"90.000mm\" height=\"90.000mm\""))
      << "seven cells of 10 mm, and one of margin on each side";
  const Image image = drawn(20);
  const auto seen = recon::find_markers(image.view(), "5X5_100", {image.layout().size, 500, 500, 90, 90, {}});
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(seen[0].id, 42);
}

TEST_F(MarkerCommandTest, ABoardIsWhatArFinds) {
  const std::string words = "charuco:5x4:30mm:22mm:4X4_50";
  ASSERT_EQ(draw(words).exit_code, 0);
  const Image image = drawn(1);
  const auto board = apply::parse_marker(words).value();
  const ImageSize size = image.layout().size;
  EXPECT_FALSE(
      apply::find_marker(image.view(), board, {size, 900, 900, size.width / 2.0, size.height / 2.0, {}})
          .empty());
}

TEST_F(MarkerCommandTest, WhatIsNoMarkerIsRefused) {
  const auto refused = draw("aruco:4X4_50:77:80mm");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(temp_ / "marker.svg"));
}

}  // namespace
}  // namespace emberlock::cli
