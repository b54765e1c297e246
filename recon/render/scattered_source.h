// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/render/in_scatter.h"

namespace emberlock::recon {

/// source += sigma_s G at the grid's key points, per voxel edge, with G trilinear between the coarse ones.
/// For field extinction, sigma is lane 3 of the source.
void add_in_scatter(const ScatterField& field, const Eigen::Vector3d& camera_center, const Grid& grid,
                    const Extinction& extinction, Pool& pool, std::vector<Rgba>& source);

/// Converts a volume whose emission is the total source, including scattered light, to the light that it
/// emits. Scattered light is treated as isotropic (the asymmetry of the phase function is neglected).
/// Negative values become 0, where more light is scattered than was seen; the rest then emits less.
void take_out_in_scatter(Volume& volume, const Hull& medium, const Effects& effects, Pool& pool);

}  // namespace emberlock::recon
