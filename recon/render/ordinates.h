// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/kernels/in_scatter.h"

namespace emberlock::recon {

/// Discrete ordinates: 2 n Gauss-Legendre nodes in the cosine to the z axis times 4 n equal steps in azimuth:
/// 8 n^2 directions that integrate spherical harmonics up to degree 4 n - 1 exactly. Octants are mirror
/// images. No direction runs along a face of a box, where a key point would see either everything or nothing.
/// n >= 1.
std::vector<Ordinate> product_ordinates(int octant_levels);

/// A phase function that ordinates can resolve. One that is too sharp is split, as in Joseph, Wiscombe and
/// Weinman (1976), into a peak straight ahead (or back) and a blunt part, with the same mean cosine.
struct SplitPhase {
  HenyeyGreenstein<float> blunt;
  double peak = 0;  ///< share of light scattered straight ahead (straight back if blunt.g < 0)

  [[nodiscard]] bool isotropic() const { return blunt.g == 0 && peak == 0; }
};
SplitPhase split_phase(double asymmetry, int octant_levels);

/// The phase function's values times solid angles, scaled on both sides so that every row sums to 1 and the
/// matrix stays reciprocal (Sinkhorn 1964): the light scattered out of one direction is conserved.
/// [to][from]; one row suffices for isotropic scattering.
std::vector<float> phase_matrix(const SplitPhase& phase, const std::vector<Ordinate>& ordinates);

}  // namespace emberlock::recon
