// SPDX-License-Identifier: Apache-2.0
#include "paper/methods.h"
#include "paper/protocol.h"

namespace emberlock::paper {

Protocol iterations_protocol(Extent extent) {
  Protocol p;
  p.name = "iterations";
  p.title = "Error against iterations and time";
  p.paper =
      "\"Color Intensity Reconstruction\": the figures of runtime and of the results after 10, 30, 50 and 70 "
      "iterations";
  p.differs =
      "The paper plots pixels and volume data against seconds and prints no numbers. Here the volume's error "
      "is the RMSE over all key points, over the "
      "truth's RMS there, as our volumes hold emission and not the paper's colour intensity.";
  Case ten{"ten-cameras", ring(10), image_size(extent)};
  ten.cameras.push_back({90, 0, recon::ViewRole::held_out});
  ten.optics = Optics::papers;
  p.cases = {ten};
  p.methods = {kPapersMethod, kDefaultMethod};
  p.iterations = extent == Extent::full
                     ? std::vector{1, 2, 3, 5, 7, 10, 14, 20, 30, 40, 50, 60, 70, 100, 140, 200}
                     : std::vector{5, 10, 30, 50, 70};
  return p;
}

}  // namespace emberlock::paper
