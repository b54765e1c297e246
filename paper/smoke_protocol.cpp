// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/algebraic_tomography/algebraic_tomography.h"
#include "paper/baselines/appearance_transfer/appearance_transfer.h"
#include "paper/baselines/sheet_decomposition/sheet_decomposition.h"
#include "paper/methods.h"
#include "paper/protocol.h"

namespace emberlock::paper {

Protocol smoke_protocol(Extent extent) {
  Protocol p;
  p.name = "smoke";
  p.title = "Smoke from three of 47 views";
  p.paper = "\"Reconstruction of Other Phenomena\": the table and the figure of smoke";
  p.differs =
      "The paper doesn't say which data set, nor which three views. Here simulated smoke is lit by the sun; "
      "47 cameras stand evenly around, "
      "and those at 0, 61 and 123 degrees are the input.";
  const int count = extent == Extent::full ? 47 : 12;
  const int apart = (count + 1) / 6;
  Case three{"three-of-47", {}, image_size(extent)};
  for (int i = 0; i < count; ++i) {
    const bool input = i % apart == 0 && i / apart < 3;
    three.cameras.push_back(
        {360.0 * i / count, 0, input ? recon::ViewRole::input : recon::ViewRole::held_out});
  }
  p.cases = {three};
  p.subject = Subject::smoke;
  p.methods = {kSheetDecompositionFacts.name, kAlgebraicTomographyFacts.name, kAppearanceTransferFacts.name,
               kPapersMethod, kDefaultMethod};
  p.printed = {{kSheetDecompositionFacts.name, "input", {10.1, 10.1, 10.1}},
               {kSheetDecompositionFacts.name, "all", {18.4, 18.4, 18.4}},
               {kPapersMethod, "input", {13.9, 13.9, 13.9}},
               {kPapersMethod, "all", {16.7, 16.7, 16.7}}};
  return p;
}

}  // namespace emberlock::paper
