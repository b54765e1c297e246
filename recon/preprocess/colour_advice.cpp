// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/colour_advice.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace emberlock::recon {

/// The most useful comes first: each is weighted by the error that it would remove.
void advise_on_colours(ColourCalibration& out) {
  std::vector<std::pair<double, std::string>> wishes;
  for (const CalibratedColour& c : out.cameras) {
    if (!c.shares_patches) {
      wishes.emplace_back(1, "camera " + c.camera +
                                 ": a picture of the shared target with patches between a tenth and "
                                 "nine tenths of white");
      continue;
    }
    if (!c.vignetting_known)
      wishes.emplace_back(0.3,
                          "camera " + c.camera +
                              ": the target in the middle, half way out and in a corner, or a flat picture");
    else if (c.flat_worst == 0 && c.corner_sigma > 0.005 * c.corner)
      wishes.emplace_back(c.corner_sigma / c.corner,
                          fmt::format("camera {}: the target nearer to the corners, or a flat picture (light "
                                      "there is {:.2f} +- {:.2f})",
                                      c.camera, c.corner, c.corner_sigma));
    const double gain = *std::max_element(c.gain_sigma.begin(), c.gain_sigma.end());
    if (gain > 0.005)
      wishes.emplace_back(
          gain, fmt::format("camera {}: more patches or lights (its gain is known to {:.1f} %)", c.camera,
                            100 * gain));
    if (c.brightest < 0.7)
      wishes.emplace_back(
          0.02,
          fmt::format("camera {}: a brighter patch or longer exposure (the brightest is {:.2f} of white)",
                      c.camera, c.brightest));
    if (c.darkest > 0.3)
      wishes.emplace_back(
          0.02, fmt::format("camera {}: a darker patch or shorter exposure (the darkest is {:.2f} of white)",
                            c.camera, c.darkest));
  }
  std::stable_sort(wishes.begin(), wishes.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  for (auto& wish : wishes) out.advice.push_back(std::move(wish.second));
}

void warn_of_colours(const ColourReadings& readings, ColourCalibration& out) {
  for (std::size_t i = 0; i < out.cameras.size(); ++i) {
    const CalibratedColour& c = out.cameras[i];
    const int used = c.uses[0];
    if (!c.shares_patches)
      out.warnings.push_back(fmt::format(
          "camera {} shares no usable patch with the others{}: its gain is left at 1 and isn't known",
          c.camera, used == 0 ? " (all its patches are saturated or dark)" : ""));
    if (!c.vignetting_known)
      out.warnings.push_back("camera " + c.camera +
                             ": too few places tell its vignetting, which is left out");
    if (readings.cameras[i].dark.histogram[1].empty())
      out.warnings.push_back("camera " + c.camera + ": no dark pictures, its dark level is taken to be 0");
    if (c.uses[3] > 0.05 * (used + c.uses[3]))
      out.warnings.push_back(fmt::format("camera {}: {} of {} readings don't fit and were left out", c.camera,
                                         c.uses[3], used + c.uses[3]));
  }
}

}  // namespace emberlock::recon
