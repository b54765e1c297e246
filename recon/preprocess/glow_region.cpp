// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/glow_region.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "recon/preprocess/samples.h"

namespace emberlock::recon {
namespace {

constexpr double kEven = 0.04;            // relative
constexpr int kLeastBlocks = 3;           // along a side
constexpr double kLeastShare = 2e-3;      // of the picture
constexpr double kSaturatedShare = 2e-3;  // of a region

/// CellSums of the three channels, averaged in square blocks.
struct GlowBlocks {
  int side = 1, columns = 0, rows = 0;
  std::vector<double> level;
  double noise = 0;  // of a block
};

double light_of_pixel(const RadianceImage& picture, int x, int y) {
  const float* rgb =
      &picture.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.size.width) +
                        static_cast<std::size_t>(x))];
  return static_cast<double>(rgb[0]) + static_cast<double>(rgb[1]) + static_cast<double>(rgb[2]);
}

GlowBlocks glow_blocks_of(const RadianceImage& picture) {
  GlowBlocks blocks;
  blocks.side = std::clamp(std::min(picture.size.width, picture.size.height) / 96, 1, 16);
  blocks.columns = picture.size.width / blocks.side;
  blocks.rows = picture.size.height / blocks.side;
  for (int row = 0; row < blocks.rows; ++row)
    for (int column = 0; column < blocks.columns; ++column) {
      double sum = 0;
      for (int y = row * blocks.side; y < (row + 1) * blocks.side; ++y)
        for (int x = column * blocks.side; x < (column + 1) * blocks.side; ++x)
          sum += light_of_pixel(picture, x, y);
      blocks.level.push_back(sum / (blocks.side * blocks.side));
    }
  const double half = 0.5 * *std::max_element(blocks.level.begin(), blocks.level.end());
  std::vector<double> differences;
  for (int y = 0; y < picture.size.height; ++y)
    for (int x = 1; x < picture.size.width; ++x) {
      const double left = light_of_pixel(picture, x - 1, y);
      const double own = light_of_pixel(picture, x, y);
      if (left > half && own > half) differences.push_back(std::abs(own - left));
    }
  if (differences.empty()) return blocks;
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  blocks.noise = *middle / (0.6745 * std::sqrt(2.0)) / blocks.side;
  return blocks;
}

/// The largest rectangle of blocks of a level, by the histogram of each row: every bar is closed by the first
/// lower one.
PatchPlace largest_rectangle(const GlowBlocks& blocks, double level, double tolerance) {
  struct Bar {
    int first, height;
  };
  PatchPlace best;
  std::vector<int> height(static_cast<std::size_t>(blocks.columns));
  for (int row = 0; row < blocks.rows; ++row) {
    std::vector<Bar> open;
    for (int column = 0; column <= blocks.columns; ++column) {
      int own = 0;
      if (column < blocks.columns) {
        const auto c = static_cast<std::size_t>(column);
        const double value = blocks.level[static_cast<std::size_t>(row * blocks.columns) + c];
        height[c] = std::abs(value - level) <= tolerance ? height[c] + 1 : 0;
        own = height[c];
      }
      int first = column;
      while (!open.empty() && open.back().height >= own) {
        const Bar bar = open.back();
        open.pop_back();
        first = bar.first;
        const bool fits = bar.height >= kLeastBlocks && column - first >= kLeastBlocks;
        if (fits && bar.height * (column - first) > best.width * best.height)
          best = {first, row + 1 - bar.height, column - first, bar.height};
      }
      if (own > 0) open.push_back({first, own});
    }
  }
  return best;
}

/// CellSums over a part of a region.
struct CellSums {
  double sum = 0, squares = 0;
  int count = 0;
  [[nodiscard]] double mean() const { return sum / count; }
  [[nodiscard]] double variance() const { return std::max(0.0, squares / count - mean() * mean()); }
};

/// `shown`: before the dark picture was taken off.
void read_channel(const RadianceImage& picture, const RadianceImage& shown,
                  const std::vector<std::uint8_t>& bounds, double step, std::size_t c, GlowPicture& out) {
  const PatchPlace& region = out.region;
  const int parts = std::min(region.width, region.height) >= 8 ? 4 : 1;  // along each side
  std::vector<CellSums> cells(static_cast<std::size_t>(parts * parts));
  CellSums all;
  int white = 0;
  int black = 0;
  for (int y = 0; y < region.height; ++y)
    for (int x = 0; x < region.width; ++x) {
      const auto pixel =
          static_cast<std::size_t>(region.y + y) * static_cast<std::size_t>(picture.size.width) +
          static_cast<std::size_t>(region.x + x);
      const auto v = static_cast<double>(picture.rgb[3 * pixel + c]);
      black += shown.rgb[3 * pixel + c] <= 0 ? 1 : 0;
      CellSums& cell =
          cells[static_cast<std::size_t>(y * parts / region.height) * static_cast<std::size_t>(parts) +
                static_cast<std::size_t>(x * parts / region.width)];
      for (CellSums* sums : {&cell, &all}) {
        sums->sum += v;
        sums->squares += v * v;
        ++sums->count;
      }
      if (!bounds.empty() && ((bounds[pixel] >> c) & 1U) != 0) ++white;
    }
  double noise = 0;  // variance of a pixel
  double uneven = 0;
  for (const CellSums& cell : cells) {
    noise += cell.variance() / static_cast<double>(cells.size());
    uneven += std::pow(cell.mean() - all.mean(), 2) / static_cast<double>(cells.size());
  }
  uneven = std::max(0.0, uneven - noise * static_cast<double>(cells.size()) / all.count);
  // Noise of half a step turns rounding into noise; without it all pixels are rounded alike.
  const double rounding = std::sqrt(noise) > 0.4 * step ? 0 : step * step / 12;
  // Noise that is cut off at black raises the mean: by 0.4 of it where half is.
  const double cut = noise * std::pow(static_cast<double>(black) / all.count, 2);
  out.level[c] = all.mean();
  out.sigma[c] = std::sqrt(noise / all.count + uneven + rounding + cut);
  out.saturated[c] = white > kSaturatedShare * all.count;
}

Error bad_glow(const std::string& where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), where, std::move(remedy)};
}

}  // namespace

std::optional<PatchPlace> find_glow(const RadianceImage& picture) {
  if (picture.rgb.empty()) return std::nullopt;
  const GlowBlocks blocks = glow_blocks_of(picture);
  const double most = *std::max_element(blocks.level.begin(), blocks.level.end());
  const double least = kLeastShare * static_cast<double>(blocks.level.size());
  // The first level that has a rectangle lies at the edge of the region's noise: one close below has more.
  PatchPlace best;
  double lowest = 0.05 * most;
  for (double level = most; level > lowest; level *= 0.98) {
    const double tolerance = std::max(kEven * level, 4 * blocks.noise);
    const PatchPlace found = largest_rectangle(blocks, level, tolerance);
    if (found.width * found.height < std::max(1.0, least)) continue;
    if (best.width == 0) lowest = level - 2 * tolerance;
    if (found.width * found.height > best.width * best.height) best = found;
  }
  if (best.width == 0) return std::nullopt;
  if (best.width > 4) best.x += 1, best.width -= 2;
  if (best.height > 4) best.y += 1, best.height -= 2;
  return PatchPlace{best.x * blocks.side, best.y * blocks.side, best.width * blocks.side,
                    best.height * blocks.side};
}

Result<GlowPicture> read_glow(const ImageView& view, const GlowPictureOptions& options,
                              const std::string& where) {
  const Colour* colour = options.colour ? &*options.colour : nullptr;
  std::vector<std::uint8_t> bounds;
  const auto developed = [&](const ImageView& from, std::vector<std::uint8_t>* marks) {
    RadianceImage picture = to_picture(samples_of(from, colour), marks);
    if (colour != nullptr) equalise(picture, *colour);
    return picture;
  };
  RadianceImage picture = developed(view, &bounds);
  const RadianceImage shown = picture;
  if (options.dark != nullptr) {
    const RadianceImage dark = developed(options.dark->view(), nullptr);
    if (dark.size != picture.size)
      return bad_glow(where, "differs in size from the dark picture", "Take both with the same settings");
    for (std::size_t i = 0; i < picture.rgb.size(); ++i) picture.rgb[i] -= dark.rgb[i];
  }
  const auto region = options.region ? options.region : find_glow(picture);
  if (!region)
    return bad_glow(where, "shows no even bright region",
                    "Bring the emitter into focus and fill more of the picture, or tell where it glows: "
                    "--region x,y,width,height");
  const ImageSize size = picture.size;
  const bool inside = region->x >= 0 && region->y >= 0 && region->width > 0 && region->height > 0 &&
                      region->width <= size.width - region->x && region->height <= size.height - region->y;
  if (!inside || region->width < 2 || region->height < 2)
    return bad_glow(where, "the region doesn't lie in the picture, or has fewer than 2 x 2 pixels",
                    "Give x,y,width,height in pixels, within " + std::to_string(size.width) + " x " +
                        std::to_string(size.height));
  GlowPicture out;
  out.region = *region;
  for (std::size_t c = 0; c < 3; ++c) {
    const double gain = colour != nullptr ? colour->gain[c] : 1;
    read_channel(picture, shown, bounds, 255.0 / view.layout.white() * gain, c, out);
  }
  return out;
}

}  // namespace emberlock::recon
