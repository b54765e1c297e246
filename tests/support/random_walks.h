// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

#include "base/random.h"
#include "recon/effects/effects.h"
#include "recon/hull/hull.h"
#include "recon/kernels/phase_function.h"
#include "recon/kernels/rgba.h"
#include "recon/render/in_scatter.h"
#include "recon/render/volume.h"
#include "tests/support/key_points.h"

// Scattering scenes for tests, and the oracle that knows their light.

namespace emberlock {

using Order = recon::Scattering::Order;

inline recon::Effects scattering(PerMeter extinction, Order order, double albedo, double asymmetry = 0) {
  recon::Effects e = recon::absorbing(extinction);
  e.scattering = {order, albedo, asymmetry};
  return e;
}

/// The volume's own extinction scatters.
inline recon::Effects scattering_field(Order order, double albedo, double asymmetry = 0) {
  recon::Effects e;
  e.extinction.model = recon::Extinction::Model::field;
  e.scattering = {order, albedo, asymmetry};
  return e;
}

/// In a medium of all of the volume's voxels.
inline recon::ScatterField scatter_field(const recon::Volume& volume, const recon::Effects& effects,
                                         recon::Pool& pool, const recon::InScatterOptions& options = {}) {
  return recon::find_in_scatter(volume, recon::whole_grid(volume.grid), effects, options, pool);
}

inline recon::Volume uniform_volume(const recon::Grid& grid, float emission) {
  return {grid, std::vector<float>(3 * grid.size(), emission), {}};
}

inline double green(const std::vector<recon::Rgba>& v, std::size_t at) {
  return static_cast<double>(v[at].c[1]);
}

inline double greatest(const std::vector<recon::Rgba>& v) {
  double high = 0;
  for (const recon::Rgba& x : v) high = std::max(high, static_cast<double>(x.c[1]));
  return high;
}

/// Two soft, coloured blobs of light in a soft cloud off their middle.
inline recon::Volume cloud(int voxels, double thickest) {
  const recon::Grid grid = cube_grid(0.2, voxels);
  recon::Volume v = uniform_volume(grid, 0);
  v.extinction.resize(grid.size());
  const auto blob = [](const Eigen::Vector3d& d, double width) {
    return std::exp(-d.squaredNorm() / (2 * width * width));
  };
  each_point(grid, [&](int i, int j, int k, std::size_t at) {
    const Eigen::Vector3d p = place_of(grid, i, j, k);
    const double a = blob(p - Eigen::Vector3d(0.03, -0.02, -0.02), 0.03);
    const double b = blob(p - Eigen::Vector3d(-0.04, 0.03, 0.03), 0.04);
    v.emission[3 * at] = static_cast<float>(3000 * a);
    v.emission[3 * at + 1] = static_cast<float>(2000 * a + 500 * b);
    v.emission[3 * at + 2] = static_cast<float>(1000 * b);
    v.extinction[at] =
        static_cast<float>(thickest * (0.2 + 0.8 * blob(p - Eigen::Vector3d(-0.01, 0.02, 0.01), 0.05)));
  });
  return v;
}

/// A volume's fields in double at any point, straight from the key points; with a medium, 0 outside it and of
/// constant extinction inside.
struct Fields {
  const recon::Volume& volume;
  const recon::Hull* medium = nullptr;
  double constant = 0;  ///< 1/m
  double emission = 0;  ///< green
  double extinction = 0;

  bool at(const Eigen::Vector3d& p) {
    const recon::Grid& g = volume.grid;
    const int voxels[3] = {g.nx - 1, g.ny - 1, g.nz - 1};
    int cell[3];
    double f[3];
    for (int a = 0; a < 3; ++a) {
      const double x = (p[a] - static_cast<double>(g.origin[a])) / static_cast<double>(g.edge);
      if (x < 0 || x > voxels[a]) return false;
      cell[a] = std::min(static_cast<int>(x), voxels[a] - 1);
      f[a] = x - cell[a];
    }
    emission = extinction = 0;
    if (medium != nullptr) {
      const int voxel = cell[0] + voxels[0] * (cell[1] + voxels[1] * cell[2]);
      if (medium->inside[static_cast<std::size_t>(voxel)] == 0) return true;
      extinction = constant;
    }
    for (int c = 0; c < 8; ++c) {
      const double w = (c & 1 ? f[0] : 1 - f[0]) * (c & 2 ? f[1] : 1 - f[1]) * (c & 4 ? f[2] : 1 - f[2]);
      const std::size_t at = g.index(cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2));
      emission += w * static_cast<double>(volume.emission[3 * at + 1]);
      if (medium == nullptr) extinction += w * static_cast<double>(volume.extinction[at]);
    }
    return true;
  }
};

inline Eigen::Vector3d turned(const Eigen::Vector3d& axis, double cosine, double azimuth) {
  const Eigen::Vector3d u = axis.unitOrthogonal();
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  return cosine * axis + sine * (std::cos(azimuth) * u + std::sin(azimuth) * axis.cross(u));
}

struct Estimate {
  double mean, deviation;
};

/// Light by random walks against it (delta tracking, Woodcock 1965): every tentative collision collects
/// emission / majorant, a real one turns the walk into a direction drawn from the phase function and
/// multiplies it by the albedo. Without bias; it shares nothing with the program but the phase function's
/// sampling.
struct RandomWalks {
  const recon::Volume& volume;
  double majorant = 0;
  recon::Scattering scattering;
  const recon::Hull* medium =
      nullptr;  ///< of constant extinction, the majorant's; the volume's field where null

  /// G at a point, towards a direction.
  [[nodiscard]] Estimate in_scatter(const Eigen::Vector3d& from, const Eigen::Vector3d& towards,
                                    int walks) const {
    return estimate(from, towards, true, walks);
  }
  /// Radiance that leaves a point along a direction.
  [[nodiscard]] Estimate radiance(const Eigen::Vector3d& from, const Eigen::Vector3d& travel,
                                  int walks) const {
    return estimate(from, travel, false, walks);
  }

 private:
  [[nodiscard]] Estimate estimate(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                                  bool turn_first, int walks) const {
    double sum = 0;
    double squares = 0;
    for (int n = 0; n < walks; ++n) {
      RandomStream random(7, static_cast<std::uint64_t>(n));
      const int turns = scattering.order == Order::multiple ? 1 << 30 : (turn_first ? 0 : 1);
      const double light = walk(from, turn_first ? turn(direction, random) : direction, turns, random);
      sum += light;
      squares += light * light;
    }
    const double mean = sum / walks;
    return {mean, std::sqrt((squares / walks - mean * mean) / walks)};
  }

  double walk(Eigen::Vector3d at, Eigen::Vector3d travel, int turns, RandomStream& random) const {
    Fields fields{volume, medium, majorant};
    double weight = 1;
    double light = 0;
    while (true) {
      at += std::log(random.uniform()) / majorant * travel;
      if (!fields.at(at)) return light;
      light += weight * fields.emission / majorant;
      if (random.uniform() * majorant >= fields.extinction) continue;
      if (turns-- == 0) return light;
      weight *= scattering.albedo;
      travel = turn(travel, random);
    }
  }

  [[nodiscard]] Eigen::Vector3d turn(const Eigen::Vector3d& travel, RandomStream& random) const {
    const double cosine = recon::HenyeyGreenstein<double>{scattering.asymmetry}.sample(random.uniform());
    return turned(travel, cosine, random.uniform(0, 2 * std::numbers::pi));
  }
};

}  // namespace emberlock
