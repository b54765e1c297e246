// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "recon/adjust/solver.h"

namespace emberlock::recon {

/// Where Solver::paper deviates from the paper's section "Volume Adjustment", or fills in what the paper
/// leaves open; one phrase each, for the reports of its runs:
/// - T, equation (12), starts at the hull. From the volume's face, as in the paper, alpha_l would be 50 to
///   100 times too small.
/// - T decreases with the length of a sample's step inside the hull, exp(-sigma_t length), not by a constant
///   opacity per sample: the intervals of a ray are divided into equal steps of at most one voxel edge.
/// - All channels stop together, by the error over all of them; the paper reconstructs and stops each
///   separately.
/// - D, of equation (10), is in voxel edges; the paper gives no unit. alpha_d = 1 belongs to its 20 cm.
/// - The deviation of G(s), of equation (11), 0.05, and the limit of 1000 iterations are ours: the paper
///   gives none.
/// - Key points outside the hull are 0.
/// Its voxels are cubes; by default there are finest_voxels() along the longest edge, not
/// voxels_by_the_paper() (pipeline/grid_choice.h).
std::vector<std::string> paper_deviations();

/// Error if effects, pictures or options require something that Solver::paper doesn't support: extinction as
/// a field, curved rays, an exposure time, saturated pixels as bounds, anisotropic scattering, double
/// precision. Background, gamma, motion and isotropic scattering are passes around any solver.
Status check_paper(const Scene& scene, const Effects& effects, const SolveOptions& options);

}  // namespace emberlock::recon
