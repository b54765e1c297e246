// SPDX-License-Identifier: Apache-2.0
#include "cli/phase_circle.h"

#include <sstream>

#include <gmock/gmock.h>

namespace emberlock::cli {
namespace {
using ::testing::HasSubstr;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

constexpr SecondsPerRow kRow = microseconds_per_row(50);
constexpr Seconds kPeriod{0.04};  // 800 rows

TEST(PhaseCircle, TheTargetIsOnTopLaterOnesToTheRight) {
  const auto lines = lines_of(phase_circle(
      {{"on", Seconds(0)}, {"later", -0.25 * kPeriod}, {"earlier", 0.25 * kPeriod}, {"dark", {}}}, kPeriod,
      Rows(100) * kRow, kRow));
  ASSERT_EQ(lines.size(), 21U);
  const auto find = [&](char letter) {
    for (std::size_t y = 0; y < lines.size(); ++y)
      for (std::size_t x = 0; x < std::min<std::size_t>(45, lines[y].size()); ++x)
        if (lines[y][x] == letter) return std::pair(x, y);
    return std::pair(std::size_t{99}, std::size_t{99});
  };
  EXPECT_EQ(find('a'), std::pair(std::size_t{22}, std::size_t{2}));
  EXPECT_EQ(find('b'), std::pair(std::size_t{38}, std::size_t{10}));
  EXPECT_EQ(find('c'), std::pair(std::size_t{6}, std::size_t{10}));
  const std::string text = phase_circle({{"dark", {}}}, kPeriod, Rows(100) * kRow, kRow);
  EXPECT_THAT(text, HasSubstr("offset from the target"));
  EXPECT_THAT(phase_circle({{"dark", {}}}, kPeriod, Rows(100) * kRow, kRow, true),
              HasSubstr("offset from its own instant"));
  EXPECT_THAT(text, HasSubstr("a dark             not seen"));
  EXPECT_THAT(text, HasSubstr("800 rows"));
}

TEST(PhaseCircle, CamerasOnOneSpotAreAllSeenOrMarkedAsSeveral) {
  std::vector<CirclePoint> cameras(3, {"x", Seconds(0)});
  const std::string few = phase_circle(cameras, kPeriod, Rows(10) * kRow, kRow);
  for (const char* letter : {"a", "b", "c"})
    EXPECT_THAT(lines_of(few)[2] + lines_of(few)[1] + lines_of(few)[0], HasSubstr(letter));
  cameras.resize(40, {"x", Seconds(0)});
  const std::string many = phase_circle(cameras, kPeriod, Rows(10) * kRow, kRow);
  EXPECT_THAT(many, HasSubstr("+"));
  for (const std::string& line : lines_of(many)) EXPECT_LE(line.size(), 100U);
  EXPECT_EQ(lines_of(many).size(), 41U);
}

}  // namespace
}  // namespace emberlock::cli
