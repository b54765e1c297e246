// SPDX-License-Identifier: Apache-2.0
#include "recon/views/picture_clues.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace emberlock::recon {
namespace {

using Levels = std::array<double, 3>;

double median(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

std::array<PixelBox, 4> sides(ImageSize size) {
  const int dx = std::max(1, size.width / 16);
  const int dy = std::max(1, size.height / 16);
  return {PixelBox{0, 0, size.width, dy}, PixelBox{0, size.height - dy, size.width, size.height},
          PixelBox{0, 0, dx, size.height}, PixelBox{size.width - dx, 0, size.width, size.height}};
}

std::optional<Levels> median_outside(const RadianceImage& image, const FlameMask& mask, const PixelBox& box) {
  Levels levels{};
  std::vector<float> values;
  for (std::size_t c = 0; c < 3; ++c) {
    values.clear();
    for (int y = box.y0; y < box.y1; ++y) {
      for (int x = box.x0; x < box.x1; ++x) {
        if (mask.at(x, y)) continue;
        const int pixel = y * image.size.width + x;
        values.push_back(image.rgb[3 * static_cast<std::size_t>(pixel) + c]);
      }
    }
    if (values.empty()) return std::nullopt;
    levels[c] = std::max(0.0, median(values));
  }
  return levels;
}

/// One channel of one picture.
class Channel {
 public:
  Channel(const RadianceImage& image, std::size_t channel, const PixelBox& box)
      : image_(image), channel_(channel), box_(box) {}

  /// The brightest value in the box, where enough pixels share it.
  [[nodiscard]] std::optional<float> shared_top() const {
    constexpr int kShared = 16;
    float top = 0;
    int shared = 0;
    for (int y = box_.y0; y < box_.y1; ++y) {
      for (int x = box_.x0; x < box_.x1; ++x) {
        const float v = at(x, y);
        if (v > top) shared = 0;
        top = std::max(top, v);
        shared += v == top ? 1 : 0;
      }
    }
    return shared >= kShared ? std::optional(top) : std::nullopt;
  }

  /// What is missing above white at each pixel of the box, 0 where nothing is: the lower of what rows and
  /// columns say.
  [[nodiscard]] std::vector<double> missing(float white) const {
    const int width = box_.x1 - box_.x0;
    const int height = box_.y1 - box_.y0;
    std::vector<double> by_rows(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    std::vector<double> by_columns(by_rows.size());
    for (int y = 0; y < height; ++y) continue_line({box_.x0, box_.y0 + y, 1, 0, width}, white, by_rows);
    for (int x = 0; x < width; ++x) continue_line({box_.x0 + x, box_.y0, 0, 1, height}, white, by_columns);
    for (std::size_t p = 0; p < by_rows.size(); ++p) by_rows[p] = std::min(by_rows[p], by_columns[p]);
    return by_rows;
  }

  void mark_clipped(float white, std::vector<std::uint8_t>& mark) const {
    for (int y = box_.y0; y < box_.y1; ++y)
      for (int x = box_.x0; x < box_.x1; ++x)
        if (at(x, y) >= white) mark[index(x, y)] = 1;
  }

 private:
  [[nodiscard]] float at(int x, int y) const {
    const int pixel = y * image_.size.width + x;
    return image_.rgb[3 * static_cast<std::size_t>(pixel) + channel_];
  }
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y - box_.y0) * static_cast<std::size_t>(box_.x1 - box_.x0) +
           static_cast<std::size_t>(x - box_.x0);
  }
  /// Pixels of a row or a column.
  struct Line {
    int x, y, dx, dy, count;
    [[nodiscard]] int px(int i) const { return x + i * dx; }
    [[nodiscard]] int py(int i) const { return y + i * dy; }
  };

  void continue_line(const Line& line, float white, std::vector<double>& out) const {
    const auto clipped = [&](int i) { return at(line.px(i), line.py(i)) >= white; };
    for (int i = 0; i < line.count; ++i) {
      if (!clipped(i)) continue;
      const int first = i;
      while (i < line.count && clipped(i)) ++i;
      // h(u) = s n u (1 - u) has the slope s at both ends of n pixels.
      const double n = i - first;
      const double slope = 0.5 * (rise(line, first - 1, -1) + rise(line, i, 1));
      for (int k = first; k < i; ++k) {
        const double u = (k - first + 0.5) / n;
        out[index(line.px(k), line.py(k))] = slope * n * u * (1 - u);
      }
    }
  }
  /// How fast the line rises towards white at i, seen from up to three pixels further in direction `away`.
  [[nodiscard]] double rise(const Line& line, int i, int away) const {
    constexpr int kReach = 3;
    const int end = std::clamp(i + kReach * away, 0, line.count - 1);
    if (i < 0 || i >= line.count || i == end) return 0;
    const float drop = at(line.px(i), line.py(i)) - at(line.px(end), line.py(end));
    return std::max(0.0, static_cast<double>(drop) / std::abs(end - i));
  }

  const RadianceImage& image_;
  std::size_t channel_;
  const PixelBox& box_;
};

}  // namespace

std::optional<BorderLevel> border_level(const Scene& scene, const std::vector<FlameMask>& masks) {
  std::vector<Levels> found;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].role != ViewRole::input) continue;
    for (const PixelBox& side : sides(scene.views[v].image->size))
      if (const auto levels = median_outside(*scene.views[v].image, masks[v], side)) found.push_back(*levels);
  }
  if (found.empty()) return std::nullopt;
  BorderLevel border;
  for (const Levels& levels : found)
    for (std::size_t c = 0; c < 3; ++c) border.level[c] += levels[c] / static_cast<double>(found.size());
  for (const Levels& levels : found)
    for (std::size_t c = 0; c < 3; ++c)
      border.unevenness = std::max(border.unevenness, std::abs(levels[c] - border.level[c]));
  return border;
}

double clip_level(const Scene& scene, const std::vector<PixelBox>& boxes, double white) {
  constexpr double kBlackLevel = 16;
  double lowest = 0;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].role != ViewRole::input || marks_saturation(scene.views[v])) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const double top =
          static_cast<double>(Channel(*scene.views[v].image, c, boxes[v]).shared_top().value_or(0));
      if (top >= white - kBlackLevel && (lowest <= 0 || top < lowest)) lowest = top;
    }
  }
  return lowest;
}

ClippedPixels clipped_pixels(const Scene& scene, const std::vector<PixelBox>& boxes, double white) {
  double missing = 0;
  double clipped = 0;
  double pixels = 0;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].role != ViewRole::input) continue;
    const PixelBox& box = boxes[v];
    std::vector<std::uint8_t> mark(static_cast<std::size_t>(box.x1 - box.x0) *
                                   static_cast<std::size_t>(box.y1 - box.y0));
    for (std::size_t c = 0; c < 3; ++c) {
      const Channel channel(*scene.views[v].image, c, box);
      const std::vector<double> more = channel.missing(static_cast<float>(white));
      for (const double m : more) missing += m * m;
      channel.mark_clipped(static_cast<float>(white), mark);
    }
    clipped += static_cast<double>(std::count(mark.begin(), mark.end(), 1));
    pixels += static_cast<double>(mark.size());
  }
  if (pixels <= 0) return {};
  return {clipped / pixels, std::sqrt(missing / (3 * pixels))};
}

}  // namespace emberlock::recon
