// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/algebraic_tomography/algebraic_tomography.h"
#include "paper/methods.h"
#include "paper/protocol.h"

namespace emberlock::paper {

Protocol captured_protocol(Extent extent) {
  Protocol p;
  p.name = "captured";
  p.title = "Simulated and captured pictures";
  p.paper =
      "\"Temperature Reconstruction\": the table of simulated and captured data, and the view between two "
      "cameras";
  p.differs =
      "The paper's films aren't public. In their place the same flame is filmed as its cameras film: 2 grey "
      "levels of noise, and cameras that "
      "point 0.5 pixels beside their calibration. The test view lies between two cameras, where the truth is "
      "known.";
  Case simulated{"simulated", ring(10), image_size(extent)};
  simulated.cameras.push_back({36, 0, recon::ViewRole::held_out});
  Case captured = simulated;
  captured.name = "as-captured";
  captured.noise = 2;
  captured.pose_error = 0.5;
  p.cases = {simulated, captured};
  p.methods = {kAlgebraicTomographyFacts.name, kPapersMethod, kDefaultMethod};
  p.printed = {{kPapersMethod, "simulated", {25.2, 15.2, 6.5}},
               {kPapersMethod, "captured", {25.8, 18.6, 23.9}}};
  return p;
}

}  // namespace emberlock::paper
