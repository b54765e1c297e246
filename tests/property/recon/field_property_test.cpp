// SPDX-License-Identifier: Apache-2.0
// Laws of the march whose emission and extinction are both unknown, and of the step that it feeds.
#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "tests/support/devices.h"
#include "tests/support/march_case.h"
#include "tests/support/properties.h"

namespace emberlock::recon {
namespace {

using test::law;

ON_EACH_DEVICE(FieldLaw);

using Values = std::vector<Rgba64>;

double number(double low, double high) {
  return low + (high - low) * *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, 1 << 20)) / (1 << 20);
}
/// Evenly spread exponents.
double magnitude(double low, double high) { return std::exp(number(std::log(low), std::log(high))); }

MarchCase some_case() {
  MarchCaseOptions options;
  options.voxels = *rc::gen::inRange(1, 14);
  options.filled = number(0.2, 1);
  options.curved = *rc::gen::arbitrary<bool>();
  options.step = static_cast<float>(magnitude(0.2, 2));
  options.seed = *rc::gen::inRange<std::uint64_t>(0, 1000);
  return march_case(options);
}

Values moved(const Values& x, double by, const Values& direction) {
  Values out = x;
  for (std::size_t p = 0; p < x.size(); ++p) out[p] = x[p] + by * direction[p];
  return out;
}

TEST_P(FieldLaw, GradientIsThatOfCentralDifferences) {
  law("d/dt 1/2 |R(x + t d)|^2 = <gradient, d>, with a background, bounds and any thickness", [] {
    const MarchCase c = some_case();
    const std::size_t rays = c.list.rays.size();
    RC_PRE(rays > 0);
    const double thick = magnitude(1e-4, 10);  // a voxel edge
    const auto seen = random_quads<float>(rays, 1, 2);
    const auto background = random_quads<float>(rays, 2, 2);
    const PixelResidual<double> residual_of{seen.data(),
                                            *rc::gen::arbitrary<bool>() ? background.data() : nullptr,
                                            nullptr, *rc::gen::element(0.0, 0.8)};
    const auto march = marches_on<double>(device_here(), c.list);
    const Values x = random_quads<double>(c.list.grid.size(), 3, 0.5, thick);
    Values d = random_quads<double>(c.list.grid.size(), 4, 1, 1);
    for (Rgba64& v : d) v = v - Rgba64{{0.5, 0.5, 0.5, 0.5}};
    const auto cost = [&](const Values& at) {
      const Values residual = march->field_forward(at, residual_of).residual;
      return 0.5 * dot(residual, residual);
    };
    const Values gradient = march->field_adjoint(march->field_forward(x, residual_of));
    const double expected = dot(gradient, d, 4);
    constexpr double kStep = 1e-5;  // balances the cube's remainder and rounding
    const double slope = (cost(moved(x, kStep, d)) - cost(moved(x, -kStep, d))) / (2 * kStep);
    // Where positive and negative slopes happen to cancel, the sum's own size is no measure.
    double size = 0;
    for (std::size_t p = 0; p < d.size(); ++p)
      for (int l = 0; l < 4; ++l) size += std::abs(gradient[p].c[l] * d[p].c[l]);
    RC_LOG() << "slope " << slope << ", gradient " << expected << ", terms " << size << ", thick " << thick;
    RC_ASSERT(std::abs(slope - expected) <= 1e-6 * size);
  });
}

TEST_P(FieldLaw, TransmittanceIsTheExponentialOfTheDepth) {
  law("T = exp(-sum of sigma ds), the depth being what an emission of sigma gives without extinction", [] {
    const MarchCase c = some_case();
    const auto march = marches_on<double>(device_here(), c.list);
    const double thick = magnitude(1e-5, 3);
    Values x = random_quads<double>(c.list.grid.size(), 5, 0, thick);
    for (Rgba64& v : x) v.c[0] = v.c[3];
    const Values depth = march->forward(Absorb::nothing, x);
    const Values seen = march->forward(Absorb::field, x);
    for (std::size_t r = 0; r < seen.size(); ++r) {
      const double expected = std::exp(-depth[r].c[0]);
      RC_ASSERT(std::abs(seen[r].c[3] - expected) <= 1e-13);
      // Emission sigma is the Planck source 1: L = 1 - T, exactly, however coarse the steps are.
      RC_ASSERT(std::abs(seen[r].c[0] + std::expm1(-depth[r].c[0])) <= 1e-13);
    }
  });
}

TEST_P(FieldLaw, AnEvenFieldIsConstantExtinction) {
  law("the field's march with the same sigma everywhere equals the constant policy's, within its "
      "single-precision lengths",
      [] {
        const MarchCase c = some_case();
        const auto march = marches_on<double>(device_here(), c.list);
        const double sigma = magnitude(1e-6, 1e6);
        Values x = random_quads<double>(c.list.grid.size(), 6);
        for (Rgba64& v : x) v.c[3] = sigma;
        const Values field = march->forward(Absorb::field, x);
        const Values constant = march->forward(Absorb::constant, x, sigma);
        for (std::size_t r = 0; r < field.size(); ++r)
          for (int l = 0; l < 4; ++l)
            RC_ASSERT(std::abs(field[r].c[l] - constant[r].c[l]) <= 1e-6 * std::max(1.0, constant[r].c[l]));
      });
}

TEST_P(FieldLaw, RadianceStaysBetweenNothingAndTheBrightestSource) {
  law("0 <= L <= max(j / sigma) (1 - T), 0 <= T <= 1, in single precision too", [] {
    const MarchCase c = some_case();
    const auto march = marches_on<float>(device_here(), c.list);
    auto x = random_quads<float>(c.list.grid.size(), 7, 1, magnitude(1e-3, 1e8));
    for (Rgba& v : x)
      for (int l = 0; l < 3; ++l) v.c[l] *= v.c[3];  // sources of 0..1
    for (const Rgba& seen : march->forward(Absorb::field, x)) {
      RC_ASSERT(seen.c[3] >= -1e-6F && seen.c[3] <= 1);
      for (int l = 0; l < 3; ++l) RC_ASSERT(seen.c[l] >= 0 && seen.c[l] <= 1 - seen.c[3] + 1e-5F);
    }
  });
}

/// Huber's total variation of lane 3 - reference between neighbours on a full grid.
double variation(const Grid& g, const Values& x, const std::vector<double>& reference, double soft) {
  const auto u = [&](int i, int j, int k) {
    const std::size_t p = g.index(i, j, k);
    return x[p].c[3] - reference[p];
  };
  const auto huber = [&](double d) {
    return std::abs(d) > soft ? std::abs(d) - soft / 2 : d * d / (2 * soft);
  };
  double sum = 0;
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) {
        if (i > 0) sum += huber(u(i, j, k) - u(i - 1, j, k));
        if (j > 0) sum += huber(u(i, j, k) - u(i, j - 1, k));
        if (k > 0) sum += huber(u(i, j, k) - u(i, j, k - 1));
      }
  return sum;
}

TEST_P(FieldLaw, AStepOfTotalVariationAloneNeverRaisesIt) {
  law("majorised steps without a residual lower the variation and keep 0 <= sigma <= most", [] {
    Grid g;
    g.nx = *rc::gen::inRange(2, 9);
    g.ny = *rc::gen::inRange(2, 9);
    g.nz = *rc::gen::inRange(2, 9);
    const double most = magnitude(0.01, 1);
    const double soft = magnitude(1e-4, 1) * most;
    const std::vector<double> weights(g.size(), magnitude(1e-6, 1));
    const std::vector<double> stiffness(g.size());
    std::vector<double> reference(g.size());
    for (std::size_t p = 0; p < g.size(); ++p) reference[p] = most * random_uniform(1, 1, p / 7);
    Values x = random_quads<double>(g.size(), 8, 1, most);
    Values gradient(g.size());
    Values next = x;
    Values y = x;
    double before = variation(g, x, reference, soft);
    const double start = before;
    for (int step = 0; step < 20; ++step) {
      const DescendField<double> descend{
          {g, weights.data(), x.data(), y.data(), next.data(), gradient.data(), stiffness.data(), 1, 0},
          weights.data(),
          reference.data(),
          magnitude(0.1, 10),
          soft,
          most};
      step_on(device_here(), descend);
      y.swap(next);
      const double now = variation(g, x, reference, soft);
      RC_ASSERT(now <= before * (1 + 1e-12));
      before = now;
    }
    RC_ASSERT(before < start);
    for (const Rgba64& v : x) RC_ASSERT(v.c[3] >= 0 && v.c[3] <= most);
  });
}

}  // namespace
}  // namespace emberlock::recon
