// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <Eigen/Core>

#include "recon/compute/pool.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

/// Parallel light from outside, which falls on a medium that scatters.
struct Sunlight {
  Eigen::Vector3d towards;           ///< the sun, unit length
  std::array<double, 3> irradiance;  ///< on a surface that faces it: grey levels times steradian
};

/// The source at a volume's key points of light that its medium scatters once, evenly in all directions:
/// albedo
/// * extinction * irradiance * exp(-depth towards the sun) / (4 pi), grey levels per metre, RGB interleaved.
/// What is scattered again is left out. The medium ends with the grid.
std::vector<float> scattered_sunlight(const Volume& volume, const Sunlight& sun, double albedo, Pool& pool);

}  // namespace emberlock::recon
