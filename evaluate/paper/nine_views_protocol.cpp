// SPDX-License-Identifier: Apache-2.0
#include "evaluate/methods.h"
#include "evaluate/paper/protocol.h"

namespace emberlock::evaluate {

Protocol nine_views_protocol(Extent extent) {
  Protocol p;
  p.name = "nine-views";
  p.title = "Nine views, the tenth as a test";
  p.paper = "\"Color Intensity Reconstruction\": the table and the figure of the extra evaluation";
  p.differs =
      "Another flame, so the paper's numbers compare among each other, as ours do. Every method has the same "
      "pictures and as many voxels.";
  Case nine{"nine-of-ten", ring(10), image_size(extent)};
  nine.cameras.back().role = recon::ViewRole::held_out;
  p.cases = {nine};
  p.methods = {kPapersMethod, kDefaultMethod};
  p.printed = {{"algebraic tomography", "input", {4.2, 2.3, 3.0}},
               {"algebraic tomography", "test", {79.3, 47.9, 28.9}},
               {kPapersMethod, "input", {12.1, 5.2, 2.5}},
               {kPapersMethod, "test", {17.6, 8.0, 3.0}}};
  return p;
}

}  // namespace emberlock::evaluate
