// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>

#include "base/image.h"
#include "base/result.h"
#include "recon/preprocess/colour.h"
#include "recon/preprocess/patch_reading.h"
#include "recon/views/radiance_image.h"

namespace emberlock::recon {

/// A picture of a furnace's mouth or a lamp's ribbon: where it glows evenly, and how brightly.
struct GlowPicture {
  PatchPlace region;
  std::array<double, 3> level = {};    ///< mean, 0..255, linear in light, gain and vignetting applied
  std::array<double, 3> sigma = {};    ///< of noise, its cut at black, rounding, and unevenness
  std::array<bool, 3> saturated = {};  ///< white in more than 0.2 % of the region: `level` is a lower bound
};

struct GlowPictureOptions {
  std::optional<Colour> colour = {};      ///< the camera's; absent: samples are linear in light
  std::optional<PatchPlace> region = {};  ///< absent: find_glow()
  const Image* dark = nullptr;  ///< the same camera without light; null: black is the colour's, or 0
};

/// The brightest even part: of blocks (each a 96th of the picture's shorter side) within 4 %, or their noise,
/// of one level, the largest rectangle, without its outermost blocks. Levels are tried from the brightest
/// downwards, until a rectangle has at least three by three blocks and 0.2 % of the picture. Absent where
/// there is none.
std::optional<PatchPlace> find_glow(const RadianceImage& picture);

/// Errors name `where`: a region that doesn't lie in the picture or has fewer than 4 pixels, none that is
/// found; a dark picture of another size.
Result<GlowPicture> read_glow(const ImageView& picture, const GlowPictureOptions& options,
                              const std::string& where);

}  // namespace emberlock::recon
