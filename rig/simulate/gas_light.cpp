// SPDX-License-Identifier: Apache-2.0
#include "rig/simulate/gas_light.h"

namespace emberlock::rig {

void GasLight::add_radiance(int camera, TimePoint /*exposure_start*/, Seconds /*exposure*/,
                            std::span<float> rgb) const {
  const recon::RadianceImage& picture = pictures_[static_cast<std::size_t>(camera)];
  for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] += gain_ * picture.rgb[i];
}

}  // namespace emberlock::rig
