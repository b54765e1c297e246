// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "base/quantity.h"
#include "drivers/virtual/light_field.h"
#include "recon/views/radiance_image.h"

namespace emberlock::rig {

/// The gas as pictures that were rendered for an instant: what virtual cameras film of it.
class GasLight final : public drivers::LightField {
 public:
  explicit GasLight(int cameras) : pictures_(static_cast<std::size_t>(cameras)) {}

  /// Before that camera's next frame is fetched, and not meanwhile.
  void show(std::size_t camera, recon::RadianceImage picture) { pictures_[camera] = std::move(picture); }
  void set_gain(double gain) { gain_ = static_cast<float>(gain); }
  /// The pictures' levels times the gain, which holds for the exposure.
  void add_radiance(int camera, TimePoint exposure_start, Seconds exposure,
                    std::span<float> rgb) const override;

 private:
  std::vector<recon::RadianceImage> pictures_;
  float gain_ = 1;
};

}  // namespace emberlock::rig
