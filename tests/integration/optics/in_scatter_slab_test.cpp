// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "recon/hull/hull.h"
#include "recon/render/in_scatter.h"
#include "tests/support/devices.h"
#include "tests/support/key_points.h"
#include "tests/support/random_walks.h"

namespace emberlock {
namespace {

ON_EACH_DEVICE(InScatterSlab);

// ---- Slabs

/// G of an isothermal slab, j = (1 - albedo) sigma B with B = 1, at its face and its middle: the integral
/// equation J(t) = 1/2 Int S(t') E1(|t - t'|) dt', S = 1 - a + a J, by iteration in double over layers of
/// constant S.
class OneDimensionalSlab {
 public:
  OneDimensionalSlab(double depth, double albedo) : depth_(depth), albedo_(albedo), j_(kLayers, 0.0) {
    for (int iteration = 0; iteration < 60; ++iteration) {
      std::vector<double> next(kLayers);
      for (int i = 0; i < kLayers; ++i) next[static_cast<std::size_t>(i)] = at((i + 0.5) / kLayers);
      j_ = next;
    }
  }
  /// At a share of the depth.
  [[nodiscard]] double at(double share) const {
    double sum = 0;
    for (int n = 0; n < kLayers; ++n) {
      const double low = (static_cast<double>(n) / kLayers - share) * depth_;
      const double high = low + depth_ / kLayers;
      const double s = 1 - albedo_ + albedo_ * j_[static_cast<std::size_t>(n)];
      // The antiderivative of E1 is -E2; both sides of the point where the layer holds it.
      const double weight =
          low < 0 && high > 0 ? 2 * e2(0) - e2(-low) - e2(high) : std::abs(e2(low) - e2(high));
      sum += 0.5 * s * weight;
    }
    return sum;
  }

 private:
  /// E2(|x|) = Int_0^1 exp(-|x| / mu) dmu, by a table of its midpoint rule.
  static double e2(double x) {
    static const std::vector<double> table = [] {
      std::vector<double> t(kTable + 2);
      for (int i = 0; i < kTable + 2; ++i)
        for (int m = 0; m < 2000; ++m)
          t[static_cast<std::size_t>(i)] += std::exp(-i * kSpacing / ((m + 0.5) / 2000)) / 2000;
      return t;
    }();
    const double place = std::abs(x) / kSpacing;
    const auto i = static_cast<std::size_t>(std::min(place, static_cast<double>(kTable)));
    const double f = std::min(1.0, place - static_cast<double>(i));
    return table[i] + f * (table[i + 1] - table[i]);
  }
  static constexpr int kLayers = 240;
  static constexpr int kTable = 1001;
  static constexpr double kSpacing = 0.01;
  double depth_, albedo_;
  std::vector<double> j_;
};

/// A wide box as an isothermal slab: `cells` thick and `width` wide, each of optical depth `cell`. G at the
/// middle of its face and of its depth.
struct SlabResult {
  double face, middle;
};
SlabResult wide_box(int cells, int width, double cell, double albedo, double asymmetry) {
  recon::Grid grid;
  grid.edge = 0.01F;
  grid.nx = grid.ny = width + 1;
  grid.nz = cells + 1;
  const PerMeter sigma(cell / 0.01);
  const recon::Volume volume = uniform_volume(grid, static_cast<float>((1 - albedo) * sigma.value()));
  recon::InScatterOptions options;
  options.voxels = width;
  options.octant_levels = 3;
  recon::Pool pool(0, device_here());
  const recon::ScatterField field =
      scatter_field(volume, scattering(sigma, Order::multiple, albedo, asymmetry), pool, options);
  const std::vector<recon::Rgba> g = recon::in_scattered(field, {0.3, 0.2, 5}, pool);
  return {green(g, grid.index(width / 2, width / 2, 0)),
          green(g, grid.index(width / 2, width / 2, cells / 2))};
}

TEST_P(InScatterSlab, SurfaceOfAThickIsothermalSlabObeysTheSquareRootLaw) {
  // S(0) = sqrt(1 - albedo) B of a half space that scatters isotropically (Chandrasekhar 1950; Rybicki and
  // Lightman 1979, section 1.8; exact): with S = (1 - a) B + a J and a = 0.5, J = (sqrt(2) - 1) B at the
  // surface.
  const OneDimensionalSlab exact(8, 0.5);
  EXPECT_NEAR(exact.at(0), std::numbers::sqrt2 - 1, 1e-3);
  const SlabResult slab = wide_box(16, 24, 0.5, 0.5, 0);
  EXPECT_NEAR(slab.face, std::numbers::sqrt2 - 1, 0.01);
  EXPECT_NEAR(slab.middle, exact.at(0.5), 0.01);
}

TEST_P(InScatterSlab, ThinSlabAgreesWithTheIntegralEquationInDouble) {
  const SlabResult slab = wide_box(8, 36, 0.25, 0.6, 0);
  const OneDimensionalSlab exact(2, 0.6);
  EXPECT_NEAR(slab.face / exact.at(0), 1, 0.02);
  EXPECT_NEAR(slab.middle / exact.at(0.5), 1, 0.02);
}

TEST_P(InScatterSlab, DeepInsideAnIsothermalMediumEveryPhaseFunctionSeesTheSourceFunction) {
  for (const double g : {0.0, 0.6, -0.6, 0.99, -0.99})
    EXPECT_NEAR(wide_box(10, 10, 2, 0.5, g).middle, 1, 0.01) << g;
}

// ---- Energy

/// Radiance that leaves at p (in coarse edges) along `travel`, in double and steps of a quarter of an edge.
double leaving(const recon::ScatterField& field, const std::vector<recon::Rgba>& g, Eigen::Vector3d p,
               const Eigen::Vector3d& travel) {
  constexpr double kStep = 0.25;
  const recon::ShiningGrid medium{field.medium.grid.nx, field.medium.grid.ny, field.medium.grid.nz,
                                  field.medium.shine.data()};
  const recon::ShiningGrid light{field.medium.grid.nx, field.medium.grid.ny, field.medium.grid.nz, g.data()};
  double radiance = 0;
  double transmittance = 1;
  p -= kStep / 2 * travel;
  for (; p.minCoeff() > 0 && p.x() < field.medium.grid.nx - 1 && p.y() < field.medium.grid.ny - 1 &&
         p.z() < field.medium.grid.nz - 1;
       p -= kStep * travel) {
    const Eigen::Vector3f q = p.cast<float>();
    const recon::Rgba m = medium.at(q.x(), q.y(), q.z());
    const auto sigma = static_cast<double>(m.c[3]);
    const double source = static_cast<double>(m.c[1]) +
                          field.albedo * sigma * static_cast<double>(light.at(q.x(), q.y(), q.z()).c[1]);
    radiance += transmittance * source * kStep * std::exp(-sigma * kStep / 2);
    transmittance *= std::exp(-sigma * kStep);
  }
  return radiance;
}

TEST_P(InScatterSlab, WhatABoxOfAlmostWhiteMediumEmitsLeavesIt) {
  const recon::Volume volume = cloud(12, 30);
  recon::Pool pool(0, device_here());
  const recon::ScatterField field = scatter_field(volume, scattering_field(Order::multiple, 0.999), pool);
  const std::vector<recon::Rgba> g = recon::in_scattered(field, {1, 0, 0}, pool);
  const int n = field.medium.grid.nx - 1;
  double emitted = 0;
  double absorbed = 0;
  each_point(field.medium.grid, [&](int i, int j, int k, std::size_t at) {
    const auto half = [&](int x) { return x == 0 || x == n ? 0.5 : 1.0; };
    const double share = 4 * std::numbers::pi * half(i) * half(j) * half(k);
    emitted += share * static_cast<double>(field.medium.shine[at].c[1]);
    absorbed += share * (1 - field.albedo) * static_cast<double>(field.medium.shine[at].c[3]) * green(g, at);
  });
  double left = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {0, n})
      for (int v = 0; v < n; ++v)
        for (int u = 0; u < n; ++u)
          for (const recon::Ordinate& o : field.ordinates) {
            const Eigen::Vector3d travel(o.travel[0], o.travel[1], o.travel[2]);
            const double out = side == 0 ? -travel[axis] : travel[axis];
            if (out <= 0) continue;
            Eigen::Vector3d p;
            p[axis] = side;
            p[(axis + 1) % 3] = u + 0.5;
            p[(axis + 2) % 3] = v + 0.5;
            left += static_cast<double>(o.weight) * out * leaving(field, g, p, travel.normalized());
          }
  EXPECT_LT(absorbed, 0.02 * emitted);
  EXPECT_NEAR((left + absorbed) / emitted, 1, 0.02);
}

TEST_P(InScatterSlab, CoarseningKeepsTheEmissionAndTheOpticalMass) {
  const recon::Volume volume = cloud(23, 30);
  recon::InScatterOptions options;
  options.voxels = 7;
  recon::Pool pool(0, device_here());
  const recon::ScatterField field =
      scatter_field(volume, scattering_field(Order::single, 0.5), pool, options);
  const auto total = [](const recon::Grid& g, const auto& value) {
    double sum = 0;
    each_point(g, [&](int i, int j, int k, std::size_t p) {
      sum += value(p) * (i == 0 || i == g.nx - 1 ? 0.5 : 1) * (j == 0 || j == g.ny - 1 ? 0.5 : 1) *
             (k == 0 || k == g.nz - 1 ? 0.5 : 1);
    });
    return sum * std::pow(static_cast<double>(g.edge), 3);
  };
  const double edge = static_cast<double>(field.medium.grid.edge);
  for (int c : {1, 3}) {
    const double fine = total(volume.grid, [&](std::size_t at) {
      return static_cast<double>(c == 3 ? volume.extinction[at] : volume.emission[3 * at + 1]);
    });
    const double coarse = total(field.medium.grid, [&](std::size_t at) {
      return static_cast<double>(field.medium.shine[at].c[c]) / edge;
    });
    EXPECT_NEAR(coarse / fine, 1, 1e-3) << c;
  }
}

}  // namespace
}  // namespace emberlock
