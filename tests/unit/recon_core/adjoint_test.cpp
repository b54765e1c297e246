// SPDX-License-Identifier: Apache-2.0
// The transposes of the marches: <A x, y> = <x, A^T y> where the extinction is known, the gradient of 1/2
// |R|^2 where it is not.
#include <gtest/gtest.h>

#include "recon/adjust/engine.h"
#include "tests/support/devices.h"
#include "tests/support/march_case.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(Adjoint);

constexpr double kExtinctions[] = {0, 0.05, 1, 20};  // a voxel edge

template <class Real>
constexpr double kBound = sizeof(Real) == sizeof(float) ? 1e-6 : 1e-12;

/// Key points x rays; the background adds T B to what is rendered, which no emission changes.
template <class Real>
void expect_transpose(const RayList& list, double sigma, const std::vector<Rgba>& background) {
  const auto march = marches_on<Real>(device_here(), list);
  const Absorb absorb = sigma > 0 ? Absorb::constant : Absorb::nothing;
  const auto x = random_quads<Real>(list.grid.size(), 5);
  const auto y = random_quads<Real>(list.rays.size(), 6);
  const std::vector<Rgba> black(list.rays.size());
  const PixelResidual<Real> residual_of{black.data(), background.empty() ? nullptr : background.data(),
                                        nullptr, 0};
  const auto judged = [&](const std::vector<Quad<Real>>& volume) {
    auto residual = march->forward(absorb, volume, static_cast<Real>(sigma));
    for (std::size_t r = 0; r < residual.size(); ++r) residual[r] = residual_of(r, residual[r]);
    return residual;
  };
  const double left = dot(judged(x), y) - dot(judged(std::vector<Quad<Real>>(x.size())), y);
  const double right = dot(x, march->adjoint(absorb, y, static_cast<Real>(sigma)));
  ASSERT_GT(left, 10);
  EXPECT_NEAR(left / right, 1, kBound<Real>) << "sigma " << sigma;
}

/// The same with the extinction in lane 3 of x, held fixed.
template <class Real>
void expect_transpose_of_field(const RayList& list, double sigma, const std::vector<Rgba>& background) {
  const auto march = marches_on<Real>(device_here(), list);
  const auto x = random_quads<Real>(list.grid.size(), 5, 1, 2 * sigma);
  const auto dark = random_quads<Real>(list.grid.size(), 5, 0, 2 * sigma);
  const std::vector<Rgba> black(list.rays.size());
  const PixelResidual<Real> residual_of{black.data(), background.empty() ? nullptr : background.data(),
                                        nullptr, 0};
  auto field = march->field_forward(x, residual_of);
  const auto y = random_quads<Real>(list.rays.size(), 6);
  const double left = dot(field.residual, y) - dot(march->field_forward(dark, residual_of).residual, y);
  field.residual = y;
  const double right = dot(x, march->field_adjoint(field));
  ASSERT_GT(left, 10);
  EXPECT_NEAR(left / right, 1, kBound<Real>) << "sigma " << sigma;
}

template <class Real>
void expect_transposes(bool curved) {
  const MarchCase c = march_case({.curved = curved});
  ASSERT_EQ(c.list.curved, curved);
  for (const auto& background : {std::vector<Rgba>{}, random_quads<float>(c.list.rays.size(), 7)}) {
    for (const double sigma : kExtinctions) {
      expect_transpose<Real>(c.list, sigma, background);
      expect_transpose_of_field<Real>(c.list, sigma, background);
    }
  }
}

TEST_P(Adjoint, OfStraightRaysIsTheTransposeInSinglePrecision) { expect_transposes<float>(false); }
TEST_P(Adjoint, OfStraightRaysIsTheTransposeInDoublePrecision) { expect_transposes<double>(false); }
TEST_P(Adjoint, OfCurvedRaysIsTheTransposeInSinglePrecision) { expect_transposes<float>(true); }
TEST_P(Adjoint, OfCurvedRaysIsTheTransposeInDoublePrecision) { expect_transposes<double>(true); }

/// Two views of a medium with holes, through even gas or a lens of it.
Problem problem_of(const RefractiveIndex* gas, Pool& pool) {
  const MarchCase c = march_case();
  const View a{"a", c.cameras[0], share(RadianceImage(c.cameras[0].intrinsics.size))};
  const View b{"b", c.cameras[1], share(RadianceImage(c.cameras[1].intrinsics.size))};
  ProblemOptions options;
  options.gas = gas;
  options.subsets = 3;
  options.subset_of = [](std::size_t view, int x, int y) { return (x + y + static_cast<int>(view)) % 4 - 1; };
  return make_problem({&a, &b}, c.medium, options, pool);
}

/// <A x, A x> = <x, A^T A x>, over every subset, of what the engine itself gives back.
void expect_transpose(const Problem& problem, const Optics& optics, Precision precision, Pool& pool) {
  const auto engine = make_engine(problem, optics, precision, pool);
  const float extinction = optics.absorb == Absorb::field ? 0.1F : 0;
  const auto x = random_quads<float>(problem.grid().size(), 5, 1, static_cast<double>(extinction));
  const std::vector<Rgba> black(problem.list.rays.size());
  engine->set(x);
  for (int s = 0; s < problem.list.subsets(); ++s) {
    engine->residual_against(black, s, Engine::Behind::nothing);  // A x
    engine->backproject(s);
  }
  const std::vector<Rgba> seen = engine->residuals();
  const double left = dot(seen, seen);
  const double right = dot(x, engine->gradient());
  ASSERT_GT(left, 10);
  EXPECT_NEAR(left / right, 1, 1e-6) << "sigma " << optics.sigma;
}

TEST_P(Adjoint, OfTheEngineIsTheTransposeUnderEveryExtinctionPathExposureAndPrecision) {
  Pool pool(2, device_here());
  const RefractiveIndex lens = lens_of_gas();
  Exposure long_one{Exposure::Shutter::integrated, Seconds(0.025), 1};
  for (const RefractiveIndex* gas : {static_cast<const RefractiveIndex*>(nullptr), &lens}) {
    const Problem problem = problem_of(gas, pool);
    for (const Precision precision : {Precision::float32, Precision::float64})
      for (const Exposure& exposure : {Exposure{}, long_one}) {
        expect_transpose(problem, {Absorb::nothing, 0, 0, exposure}, precision, pool);
        for (const float sigma : {0.05F, 1.F, 5.F})
          expect_transpose(problem, {Absorb::constant, sigma, 0, exposure}, precision, pool);
        expect_transpose(problem, {Absorb::field, 0, 0, exposure}, precision, pool);
      }
  }
}

TEST_P(Adjoint, OfTheEngineHasTheSameBitsOnEveryRun) {
  Pool pool(2, device_here());
  const Problem problem = problem_of(nullptr, pool);
  std::vector<Rgba> first;
  for (int run = 0; run < 3; ++run) {
    const auto engine = make_engine(problem, {Absorb::field, 0, 0, {}}, Precision::float32, pool);
    engine->set(random_quads<float>(problem.grid().size(), 5, 1, 0.1));
    engine->residual(0);
    engine->backproject(0);
    const std::vector<Rgba> gradient = engine->gradient();
    if (run == 0) first = gradient;
    for (std::size_t p = 0; p < first.size(); ++p)
      for (int c = 0; c < 4; ++c) ASSERT_EQ(gradient[p].c[c], first[p].c[c]) << p;
  }
}

}  // namespace
}  // namespace emberlock::recon
