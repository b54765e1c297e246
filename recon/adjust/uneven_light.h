// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/adjust/tracker.h"
#include "recon/render/in_scatter.h"

namespace emberlock::recon {

/// What scattering that favours a direction adds to each ray, beyond the even light that a solver's emission
/// holds already: the source's own light is scattered towards each camera. How it depends on the emission is
/// not followed by the adjoint, so it is found anew as the emission becomes known.
class UnevenLight {
 public:
  /// `source` holds all of the medium's light, what it scatters included. The setup must outlive it.
  UnevenLight(const SolverSetup& setup, Volume source);
  /// One a ray of the problem through these views.
  std::vector<Rgba> operator()(const std::vector<const View*>& views, const Problem& problem) const;

 private:
  const SolverSetup& setup_;
  Volume source_;
  Volume emission_;
  ScatterField field_;
};

}  // namespace emberlock::recon
