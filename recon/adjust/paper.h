// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "recon/adjust/solver.h"

namespace emberlock::recon {

/// Where Solver::paper isn't what the paper's section "Volume Adjustment" says, or what the paper leaves open
/// and we chose; one phrase each, for the reports of its runs:
/// - T, equation (12), starts at the hull. From the volume's face, as the paper has it, alpha_l would be 50
/// to
///   100 times too small.
/// - T falls with the length of a sample's step inside the hull, exp(-sigma_t length), not by a constant
///   opacity a sample: the pieces of a ray are cut into equal steps of at most one voxel edge.
/// - The channels stop together, by the error over all of them; the paper reconstructs and stops each by
///   itself.
/// - D, of equation (10), is in voxel edges; the paper gives no unit. alpha_d = 1 belongs to its 20 cm.
/// - The deviation of G(s), of equation (11), 0.05, and the limit of 1000 iterations are ours: the paper
///   gives none.
/// - Key points outside the hull hold 0.
/// Its voxels are cubes; without a number of them there are finest_voxels() along the longest edge, not
/// voxels_by_the_paper() (pipeline/grid_choice.h).
std::vector<std::string> paper_deviations();

/// An Error where the effects, the pictures or the options ask for something that Solver::paper knows nothing
/// of: extinction as a field, curved rays, an exposure time, saturated pixels as bounds, uneven scattering,
/// double precision. Background, gamma, motion and even scattering are passes around any solver.
Status check_paper(const Scene& scene, const Effects& effects, const SolveOptions& options);

}  // namespace emberlock::recon
