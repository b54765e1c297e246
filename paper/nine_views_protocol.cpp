// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/algebraic_tomography/algebraic_tomography.h"
#include "paper/methods.h"
#include "paper/protocol.h"

namespace emberlock::paper {

Protocol nine_views_protocol(Extent extent) {
  Protocol p;
  p.name = "nine-views";
  p.title = "Nine views, the tenth as a test";
  p.paper = "\"Color Intensity Reconstruction\": the table and the figure of the extra evaluation";
  p.differs =
      "Another flame, so the paper's numbers compare among each other, as ours do. The paper renders its "
      "flame by its own model, an opacity "
      "of 0.05 a step; that is one case here, and soot as thin as physics has it the other, where light that "
      "nothing absorbs is nearly the "
      "truth. Every method has the same pictures and as many voxels.";
  Case physical{"as-soot-glows", ring(10), image_size(extent)};
  physical.cameras.back().role = recon::ViewRole::held_out;
  Case papers = physical;
  papers.name = "as-the-paper-renders";
  papers.optics = Optics::papers;
  p.cases = {papers, physical};
  for (const Method& method : methods()) p.methods.push_back(method.facts.name);
  p.printed = {{kConvergedAlgebraicTomographyFacts.name, "input", {4.2, 2.3, 3.0}},
               {kConvergedAlgebraicTomographyFacts.name, "test", {79.3, 47.9, 28.9}},
               {kPapersMethod, "input", {12.1, 5.2, 2.5}},
               {kPapersMethod, "test", {17.6, 8.0, 3.0}}};
  return p;
}

}  // namespace emberlock::paper
