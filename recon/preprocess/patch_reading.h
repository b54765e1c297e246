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

/// The reading of one patch in a picture. Samples are relative to the sensor's white: 0..1.
struct PatchReading {
  std::size_t camera = 0;
  std::string patch;  ///< readings of the same patch in the same light have the same radiance, in every
                      ///< camera and place
  std::string light = {};
  std::string picture = {};  ///< for messages
  double exposure = 1;       ///< relative exposure time
  double x = 0, y = 0;       ///< middle of the patch, pixel centres at +0.5
  std::array<double, 3> mean = {};
  std::array<double, 3> variance = {};   ///< of one sample
  std::array<double, 3> saturated = {};  ///< share of saturated samples
  std::array<int, 3> count = {};         ///< number of samples; 0: the channel wasn't measured
};

/// A flat picture (with uniform radiance), averaged in cells that divide it evenly.
struct FlatReading {
  std::size_t camera = 0;
  ImageSize size;  ///< of the picture
  int columns = 0, rows = 0;
  std::vector<PatchReading> cells;  ///< row by row
};

/// Samples without light.
struct DarkReading {
  /// Share of samples in each of 256 steps from 0 to white, by channel; empty without dark pictures.
  std::array<std::vector<double>, 3> histogram = {};
  std::vector<std::uint32_t> hot_pixels;
};

/// Mean and variance of a patch, by channel; samples further than five robust sigma from the median (dirt,
/// hot pixels) are ignored. `place` must lie inside the picture.
PatchReading read_patch(const ImageView& picture, const PatchPlace& place);

/// The cells of a flat picture, about 48 per row, with sides of at least 16 pixels.
FlatReading read_flat(const ImageView& picture);

/// The same as 12 x 12 coarse patches that all have the same radiance: is_flat().
std::vector<PatchReading> flat_patches(const ImageView& picture, const std::string& name);
[[nodiscard]] bool is_flat(const PatchReading& reading);

/// From at least one picture; all of the same layout.
DarkReading read_dark(const std::vector<Image>& pictures);

/// The median of the samples without light, 0 if they are unknown. Not their mean, because clipping at black
/// changes it.
double dark_sample(const DarkReading& dark, std::size_t channel);

/// Standard deviation of a patch's mean, relative to white; `step`: resolution of its camera's samples.
double mean_sigma(const PatchReading& reading, std::size_t channel, double step);

enum class ReadingUse { used, saturated, dark, outlier };

/// Whether a patch's mean is usable: `used`, saturated, or too dark, if samples without light have the value
/// `dark`.
ReadingUse use_of(const PatchReading& reading, std::size_t channel, double dark);

}  // namespace emberlock::recon
