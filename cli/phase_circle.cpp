// SPDX-License-Identifier: Apache-2.0
#include "cli/phase_circle.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>

#include <fmt/format.h>

namespace emberlock::cli {
namespace {

// Characters are about twice as high as wide.
constexpr int kCircleRows = 21;
constexpr int kCircleColumns = 45;
constexpr int kMiddleRow = kCircleRows / 2;
constexpr int kMiddleColumn = kCircleColumns / 2;
constexpr double kCircleRadius = 8;  // in rows; letters that find their place taken move outwards

char letter_of(std::size_t camera) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
  return camera < kLetters.size() ? kLetters[camera] : '#';
}

/// A page of characters whose middle is the circle's.
class CirclePage {
 public:
  /// The character at a share of a turn, clockwise from the top.
  char& at(double turn, double radius) {
    const double angle = 2 * M_PI * turn;
    const auto x = static_cast<int>(std::lround(kMiddleColumn + 2 * radius * std::sin(angle)));
    const auto y = static_cast<int>(std::lround(kMiddleRow - radius * std::cos(angle)));
    return lines_[static_cast<std::size_t>(std::clamp(y, 0, kCircleRows - 1))]
                 [static_cast<std::size_t>(std::clamp(x, 0, kCircleColumns - 1))];
  }
  void write(int row, const std::string& text) {
    const auto from = static_cast<std::size_t>(kMiddleColumn) - text.size() / 2;
    lines_[static_cast<std::size_t>(row)].replace(from, text.size(), text);
  }
  [[nodiscard]] const std::vector<std::string>& lines() const { return lines_; }

 private:
  std::vector<std::string> lines_ = std::vector<std::string>(kCircleRows, std::string(kCircleColumns, ' '));
};

void draw_camera(CirclePage& page, double turn, char letter) {
  for (double radius = kCircleRadius; radius < kCircleRadius + 3; radius += 0.8) {
    char& place = page.at(turn, radius);
    if (place != '.' && place != ':' && place != ' ') continue;
    place = letter;
    return;
  }
  page.at(turn, kCircleRadius) = '+';  // several
}

std::string offset_line(char letter, const CirclePoint& camera, SecondsPerRow row_time) {
  if (!camera.error) return fmt::format("{} {:<16} not seen", letter, camera.name);
  return fmt::format("{} {:<16} {:+8.1f} rows {:+8.3f} ms", letter, camera.name,
                     (*camera.error / row_time).value(), in_milliseconds(*camera.error));
}

}  // namespace

std::string phase_circle(const std::vector<CirclePoint>& cameras, Seconds period, Seconds tolerance,
                         SecondsPerRow row_time, bool staggered) {
  CirclePage page;
  constexpr int kSteps = 240;
  for (int i = 0; i < kSteps; ++i) {
    const double turn = static_cast<double>(i) / kSteps;
    const double off = std::min(turn, 1 - turn) * period.value();
    page.at(turn, kCircleRadius) = off <= tolerance.value() ? ':' : '.';
  }
  page.write(kCircleRows / 2 - 6, "0");  // the target
  page.write(kCircleRows / 2 - 1, fmt::format("{:.0f} rows", (period / row_time).value()));
  page.write(kCircleRows / 2, "to a turn");
  page.write(kCircleRows / 2 + 1, fmt::format(":  {:.4g} rows", (tolerance / row_time).value()));
  std::vector<std::string> legend{staggered ? "offset from its own instant, + earlier"
                                            : "offset from the target, + earlier"};
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (cameras[i].error) draw_camera(page, -*cameras[i].error / period, letter_of(i));
    legend.push_back(offset_line(letter_of(i), cameras[i], row_time));
  }
  // Beside the circle, in its middle if it is shorter.
  const std::size_t height = std::max(page.lines().size(), legend.size());
  const std::size_t above = (height - legend.size()) / 2;
  std::string text;
  for (std::size_t i = 0; i < height; ++i) {
    std::string line = i < page.lines().size() ? page.lines()[i] : std::string(kCircleColumns, ' ');
    if (i >= above && i - above < legend.size()) line += "  " + legend[i - above];
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

}  // namespace emberlock::cli
