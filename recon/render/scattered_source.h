// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/render/in_scatter.h"

namespace emberlock::recon {

/// source += sigma_s G at the grid's key points, a voxel edge, G trilinear between the coarse ones. Where the
/// extinction is a field it is lane 3 of the source.
void add_in_scatter(const ScatterField& field, const Eigen::Vector3d& camera_center, const Grid& grid,
                    const Extinction& extinction, Pool& pool, std::vector<Rgba>& source);

/// Takes a volume whose emission is all of its source, scattered light included, and leaves the light that it
/// emits. Scattered light is taken as even in all directions (the phase function's asymmetry is left out).
/// What would be negative becomes 0: more is scattered there than was seen, which the rest then emits less
/// for.
void take_out_in_scatter(Volume& volume, const Hull& medium, const Effects& effects, Pool& pool);

}  // namespace emberlock::recon
