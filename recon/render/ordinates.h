// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/kernels/in_scatter.h"

namespace emberlock::recon {

/// Discrete ordinates: 2 n Gauss-Legendre nodes in the cosine to the z axis times 4 n equal steps in azimuth,
/// 8 n^2 directions that integrate spherical harmonics up to degree 4 n - 1 exactly. Octants mirror each
/// other, and none runs along a face of a box, where a key point on it would see either all or nothing. n
/// >= 1.
std::vector<Ordinate> product_ordinates(int octant_levels);

/// A phase function as ordinates can resolve it: one too sharp for them is split, as Joseph, Wiscombe and
/// Weinman (1976) do, into a peak straight ahead (or back) and a blunt one, with the same mean cosine.
struct SplitPhase {
  HenyeyGreenstein<float> blunt;
  double peak = 0;  ///< share of light scattered straight ahead (straight back, where blunt.g < 0)

  [[nodiscard]] bool isotropic() const { return blunt.g == 0 && peak == 0; }
};
SplitPhase split_phase(double asymmetry, int octant_levels);

/// Rows of the phase function's values times solid angles, scaled on both sides so that every row sums to 1
/// and the matrix stays reciprocal (Sinkhorn 1964): what is scattered out of one direction arrives in all.
/// [to][from]; one row suffices for isotropic scattering.
std::vector<float> phase_matrix(const SplitPhase& phase, const std::vector<Ordinate>& ordinates);

}  // namespace emberlock::recon
