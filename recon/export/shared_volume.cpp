// SPDX-License-Identifier: Apache-2.0
#include "recon/export/shared_volume.h"

#include <algorithm>
#include <cstddef>

#include <fmt/format.h>

namespace emberlock::recon {

const SharedGrid* SharedVolume::find(const std::string& name) const {
  const auto at =
      std::find_if(grids.begin(), grids.end(), [&](const SharedGrid& g) { return g.name == name; });
  return at == grids.end() ? nullptr : &*at;
}

float luminance(const float* rgb) { return 0.2126F * rgb[0] + 0.7152F * rgb[1] + 0.0722F * rgb[2]; }

float brightest(const SharedVolume& volume) {
  float most = 0;
  if (const SharedGrid* emission = volume.find("emission"))
    for (std::size_t p = 0; p < volume.grid.size(); ++p)
      most = std::max(most, luminance(&emission->values[3 * p]));
  return most;
}

void add_flame(SharedVolume& volume, float white) {
  const SharedGrid* emission = volume.find("emission");
  if (emission == nullptr) return;
  std::vector<float> share(volume.grid.size());
  for (std::size_t p = 0; p < share.size(); ++p)
    share[p] = std::clamp(luminance(&emission->values[3 * p]) / white, 0.0F, 1.0F);
  std::erase_if(volume.grids, [](const SharedGrid& grid) { return grid.name == kFlame; });  // an earlier one
  volume.grids.push_back(
      {kFlame, "1",
       fmt::format(
           "luminance of emission, 0.2126 R + 0.7152 G + 0.0722 B; 1 stands for {} grey levels per metre",
           white),
       std::move(share)});
}

void add_told(SharedVolume& volume) {
  const SharedGrid* kelvin = volume.find("temperature");
  if (kelvin == nullptr) return;
  std::vector<float> told(volume.grid.size());
  std::transform(kelvin->values.begin(), kelvin->values.end(), told.begin(),
                 [](float t) { return t > 0 ? 1.0F : 0.0F; });
  std::erase_if(volume.grids, [](const SharedGrid& grid) { return grid.name == "temperature_told"; });
  volume.grids.push_back({"temperature_told", "1", "1 where temperature is told, else 0", std::move(told)});
}

}  // namespace emberlock::recon
