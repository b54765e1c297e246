// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recon/views/view.h"

namespace emberlock::recon {

/// Why the reported error may say little about the volume, as sentences for the user; empty if all is well.
/// Considers the number of input views, their angles as seen from the box (opposite views count as one,
/// because they see the same silhouette), and whether a view is held out.
std::vector<std::string> coverage_warnings(const Scene& scene);

/// Where so many voxels along the longest edge are more than voxels_by_the_paper(): that they are finer than
/// the input views resolve, and what to ask for instead. Otherwise empty.
std::string too_fine_warning(const Scene& scene, int voxels);

}  // namespace emberlock::recon
