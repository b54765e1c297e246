// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/adjust/tracker.h"
#include "recon/render/in_scatter.h"

namespace emberlock::recon {

/// The contribution of anisotropic scattering to each ray, in addition to the isotropic part, which a
/// solver's emission already contains: the source's own light scattered towards each camera. The adjoint
/// neglects its dependence on the emission, so it is recomputed as the emission becomes known.
class UnevenLight {
 public:
  /// `source` contains all of the medium's light, including scattered light. The setup must outlive it.
  UnevenLight(const SolverSetup& setup, Volume source);
  /// One value per ray of the problem through these views.
  std::vector<Rgba> operator()(const std::vector<const View*>& views, const Problem& problem) const;

 private:
  const SolverSetup& setup_;
  Volume source_;
  Volume emission_;
  ScatterField field_;
};

}  // namespace emberlock::recon
