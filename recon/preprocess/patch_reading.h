// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/image.h"

namespace emberlock::recon {

/// Pixels [x, x + width) x [y, y + height).
struct PatchPlace {
  int x = 0, y = 0, width = 0, height = 0;
};

/// What a picture shows of one patch. Samples are relative to the sensor's white: 0..1.
struct PatchReading {
  std::size_t camera = 0;
  std::string patch;  ///< readings of one patch in one light saw one radiance, in whatever camera and place
  std::string light = {};
  std::string picture = {};  ///< for messages
  double exposure = 1;       ///< relative exposure time
  double x = 0, y = 0;       ///< the patch's middle, pixel centres at +0.5
  std::array<double, 3> mean = {};
  std::array<double, 3> variance = {};   ///< of one sample
  std::array<double, 3> saturated = {};  ///< share of the samples
  std::array<int, 3> count = {};         ///< samples; 0: the channel wasn't seen
};

/// A flat picture, which shows one radiance everywhere, in cells that divide it evenly.
struct FlatReading {
  std::size_t camera = 0;
  ImageSize size;  ///< of the picture
  int columns = 0, rows = 0;
  std::vector<PatchReading> cells;  ///< in rows
};

/// Samples without light.
struct DarkReading {
  /// Shares of samples in 256 steps from 0 to white, by channel; empty without dark pictures.
  std::array<std::vector<double>, 3> histogram = {};
  std::vector<std::uint32_t> hot_pixels;
};

/// Mean and variance of a patch, by channel; samples further than five robust sigma from the median (dirt,
/// hot pixels) are left out. `place` lies inside the picture.
PatchReading read_patch(const ImageView& picture, const PatchPlace& place);

/// A flat picture's cells, some 48 along a row, of at least 16 pixels a side.
FlatReading read_flat(const ImageView& picture);

/// The same in twelve by twelve coarse patches, which all saw one radiance: is_flat().
std::vector<PatchReading> flat_patches(const ImageView& picture, const std::string& name);
[[nodiscard]] bool is_flat(const PatchReading& reading);

/// Of at least one picture of one layout.
DarkReading read_dark(const std::vector<Image>& pictures);

/// The median of the samples without light, 0 where they aren't known. Not their mean: black clips noise from
/// below, which light doesn't see.
double dark_sample(const DarkReading& dark, std::size_t channel);

/// Standard deviation of a patch's mean, relative to white; `step`: of its camera's samples.
double mean_sigma(const PatchReading& reading, std::size_t channel, double step);

enum class ReadingUse { used, saturated, dark, outlier };

/// Whether a patch's mean tells radiance: `used`, or saturated, or too dark, where samples without light are
/// `dark`.
ReadingUse use_of(const PatchReading& reading, std::size_t channel, double dark);

}  // namespace emberlock::recon
