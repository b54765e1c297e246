// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "recon/compute/device.h"
#include "recon/views/radiance_image.h"

namespace emberlock::recon {

struct Scene;

/// Pixels [x0, x1) x [y0, y1).
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  [[nodiscard]] bool empty() const { return x1 <= x0 || y1 <= y0; }
};

/// Which pixels show the flame: those whose brightest channel lies above the threshold. Pixels that a view
/// leaves out count as flame, since it may burn behind them; the box holds those that touch a seen flame.
struct FlameMask {
  ImageSize size;
  double threshold = 0;             ///< grey levels
  std::vector<std::uint8_t> flame;  ///< 1 or 0, row-major, width * height
  PixelBox box;                     ///< the smallest that holds every flame pixel; empty without any
  std::shared_ptr<const std::uint8_t> on_gpu = {};  ///< where it was made on a GPU: `flame` in its memory
  [[nodiscard]] bool at(int x, int y) const {
    return flame[static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width) +
                 static_cast<std::size_t>(x)] != 0;
  }
};

/// The paper's fixed threshold. It puts a floor of some 4 grey levels under every reconstruction error.
inline constexpr double kPaperFlameThreshold = 30;

/// A threshold from the picture's own noise, grey levels: the background plus about six sigma, and at least
/// one grey level, from the mean and the brightest pixel of small blocks, their medians over the picture. At
/// least half of the blocks must show background; a picture smaller than 4 x 4 has a threshold of 1.
double noise_threshold(const RadianceImage& image);

FlameMask flame_mask(const RadianceImage& image, double threshold);

/// The mask at the picture's own noise_threshold, without specks: a flame pixel has at least three others
/// among its eight neighbours. A hot pixel or the tail of the noise would stretch the box and grow the hull.
FlameMask noise_mask(const RadianceImage& image);

/// How the noise of a picture of this size is measured: edge of its square blocks, blocks in a row, and in
/// all.
struct NoiseBlocks {
  int edge = 1, across = 0, count = 0;
};
NoiseBlocks noise_blocks(ImageSize size);
/// The threshold from the mean and the brightest pixel of each block, which it sorts. `least` is the largest
/// float that isn't above it.
struct NoiseThreshold {
  double value = 1;
  float least = 1;
};
NoiseThreshold noise_threshold(const NoiseBlocks& blocks, std::vector<double>& means,
                               std::vector<float>& peaks);
/// The largest float that isn't above a double: a float is above the one exactly where it is above the other.
float not_above(double value);

/// Masks of all views, in order, the same on every device; without a threshold each view's own noise_mask.
/// Throws a DeviceError where a GPU fails.
std::vector<FlameMask> flame_masks(const Scene& scene, std::optional<double> threshold = std::nullopt,
                                   const ComputeOptions& compute = {});

}  // namespace emberlock::recon
