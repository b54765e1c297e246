// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/image.h"
#include "recon/kernels/develop.h"

namespace emberlock::recon {

/// A frame as the sensor gave it, and all that makes its radiance, pixel by pixel: what develop() did, to be
/// done again elsewhere. `light` without the numbers' light, which is in `exposures`.
struct RawPicture {
  std::shared_ptr<const Image> frame;
  std::vector<float> exposures;  ///< for `light`
  LightOfNumber light;
  std::vector<std::uint32_t> hot = {};                      ///< pixels that are replaced, ascending
  std::shared_ptr<const std::vector<float>> dark = {};      ///< taken from the samples; null: nothing
  std::vector<float> smear_of_row = {};                     ///< taken from those of every row; empty: nothing
  std::optional<TakeSmearOfRows> smear_of_other_rows = {};  ///< where a smear's path isn't the whole column
  Demosaicing demosaicing = Demosaicing::bilinear;
  EqualisePixel equalise = {};
  std::vector<float> flat = {};  ///< light of `equalise.flat`; empty: none
};

}  // namespace emberlock::recon
