// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/compute/pool.h"
#include "recon/effects/effects.h"
#include "recon/kernels/grid.h"
#include "recon/kernels/rgba.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

/// What reaches each key point of a light from outside: exp(-depth towards it), over the squared distance in
/// metres where it is nearby; 1 of one that shines evenly, or not at all. Lane 3 of `medium` is the
/// extinction a voxel edge. The medium ends with the grid. Light is smooth where its medium isn't: it is
/// computed at every n-th key point, of which there are at most 49 along the longest side, and is trilinear
/// between them.
std::vector<float> light_that_reaches(const std::vector<Rgba>& medium, const Grid& grid, const Light& light,
                                      Pool& pool);

/// What a volume's extinction scatters of a light: Light's S at the key points, grey levels a metre, RGB
/// interleaved. There must be an extinction.
std::vector<float> lit_emission(const Volume& volume, const Light& light, Pool& pool);

}  // namespace emberlock::recon
