// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/colour_temperature/colour_temperature.h"
#include "paper/methods.h"
#include "paper/protocol.h"

namespace emberlock::paper {

Protocol four_views_protocol(Extent extent) {
  Protocol p;
  p.name = "four-views";
  p.title = "Four views in a plane";
  p.paper = "\"Temperature Reconstruction\": the comparison with Wu et al. 2014 at 0, 45, 90 and 135 degrees";
  p.differs =
      "The paper compares the input views of a captured flame. Here four further views between them are "
      "tests as well, since input views "
      "prove little.";
  Case four{"four-cameras", {}, image_size(extent, {200, 310})};
  for (const double azimuth : {0.0, 45.0, 90.0, 135.0})
    four.cameras.push_back({azimuth, 0, recon::ViewRole::input});
  for (const double azimuth : {22.5, 67.5, 112.5, 157.5})
    four.cameras.push_back({azimuth, 0, recon::ViewRole::held_out});
  p.cases = {four};
  p.methods = {kColourTemperatureFacts.name, kPapersMethod, kDefaultMethod};
  p.temperatures = true;
  return p;
}

}  // namespace emberlock::paper
