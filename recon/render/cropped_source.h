// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/effects/effects.h"
#include "recon/hull/ray_list.h"
#include "recon/kernels/rgba.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

/// What the march reads: emission, and in lane 3 the extinction if it is a field, per voxel edge, at the
/// cropped grid's key points.
std::vector<Rgba> cropped_source(const Volume& volume, const CroppedHull& crop, Extinction::Model extinction);

}  // namespace emberlock::recon
