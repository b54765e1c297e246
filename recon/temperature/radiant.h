// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "recon/compute/device.h"
#include "recon/kernels/grid.h"

namespace emberlock::recon {

/// What radiates heat: a grey body's temperature and absorption at key points, trilinear between them. Both
/// of size grid.size(); 0 K: it radiates nothing, but absorbs.
struct HotVolume {
  Grid grid;
  std::vector<float> kelvin;
  std::vector<float> absorption;  ///< 1/m
};

/// The radiance over all wavelengths along a ray from `eye`, W / (sr m^2): the integral of kappa sigma T^4 /
/// pi times the transmittance, in steps of half a voxel edge. `direction`: unit length.
double total_radiance(const HotVolume& volume, const Eigen::Vector3d& eye, const Eigen::Vector3d& direction);

/// What leaves it in all directions, W: parallel rays two edges apart, over 64 directions (Fibonacci's
/// sphere). Of a homogeneous ball of optical radius t: 4 pi R^2 sigma T^4 (1 - (1 - (1 + 2 t) exp(-2 t)) / (2
/// t^2)).
double radiated_power(const HotVolume& volume, const ComputeOptions& compute = {});

/// What falls on a small surface, W / m^2: 4096 directions, weighted by their cosine. They are those in which
/// the ball around the volume is seen from outside it; from inside, the hemisphere. `normal`: unit length,
/// towards the flame.
double radiant_flux(const HotVolume& volume, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                    const ComputeOptions& compute = {});

struct TargetSphere {
  Eigen::Vector3d center;
  double radius = 0;  ///< m, > 0
};
struct SphereFlux {
  double mean = 0, most = 0;  ///< W / m^2, over the surface and where it is strongest
  double power = 0;           ///< W, that the sphere catches
  double held = 0;            ///< the share of what radiates, by absorption and T^4, that lies within it
};
/// What falls on a black sphere: radiant_flux() at 256 points (Fibonacci's sphere), of 1024 directions each.
/// A sphere that holds more than half of what radiates catches on its inner side, any other on its outer
/// side.
SphereFlux radiant_flux(const HotVolume& volume, const TargetSphere& target,
                        const ComputeOptions& compute = {});

/// Of key points that tell a temperature; the weight is the absorption where there is one, else 1.
struct HotStatistics {
  std::size_t points = 0;
  double volume = 0;                ///< m^3
  double height = 0;                ///< m, between the lowest and the highest along `up`
  double mean = 0, mean_error = 0;  ///< K; the error as if all voxels were off alike
  double most = 0, most_error = 0;  ///< K, the hottest voxel's and its own error
};
/// `sigma`: one error a key point. `up`: unit length.
HotStatistics statistics_of(const HotVolume& volume, const std::vector<float>& sigma,
                            const Eigen::Vector3d& up);

}  // namespace emberlock::recon
