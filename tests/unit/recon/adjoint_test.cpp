// The transposes of the marches: <A x, y> = <x, A^T y> where the extinction is known, the gradient of 1/2
// |R|^2 where it is not.
#include <gtest/gtest.h>

#include "tests/support/march_case.h"

namespace emberlock {
namespace {

constexpr double kExtinctions[] = {0, 0.05, 1, 20};  // a voxel edge

template <class Real>
constexpr double kBound = sizeof(Real) == sizeof(float) ? 1e-6 : 1e-12;

/// Key points x rays; the background adds T B to what is rendered, which no emission changes.
template <class Real>
void expect_transpose(const RayList& list, double sigma, const std::vector<Rgba>& background) {
  const Marcher<Real> march(list);
  const Absorb absorb = sigma > 0 ? Absorb::constant : Absorb::nothing;
  const auto x = random_quads<Real>(list.grid.size(), 5);
  const auto y = random_quads<Real>(list.rays.size(), 6);
  const std::vector<Rgba> black(list.rays.size());
  const Judge<Real> judge{black.data(), background.empty() ? nullptr : background.data(), nullptr, 0};
  const auto judged = [&](const std::vector<Quad<Real>>& volume) {
    auto residual = march.forward(absorb, volume, static_cast<Real>(sigma));
    for (std::size_t r = 0; r < residual.size(); ++r) residual[r] = judge(r, residual[r]);
    return residual;
  };
  const double left = dot(judged(x), y) - dot(judged(std::vector<Quad<Real>>(x.size())), y);
  const double right = dot(x, march.adjoint(absorb, y, static_cast<Real>(sigma)));
  ASSERT_GT(left, 10);
  EXPECT_NEAR(left / right, 1, kBound<Real>) << "sigma " << sigma;
}

/// The same with the extinction in lane 3 of x, held fixed.
template <class Real>
void expect_transpose_of_field(const RayList& list, double sigma, const std::vector<Rgba>& background) {
  const Marcher<Real> march(list);
  const auto x = random_quads<Real>(list.grid.size(), 5, 1, 2 * sigma);
  const auto dark = random_quads<Real>(list.grid.size(), 5, 0, 2 * sigma);
  const std::vector<Rgba> black(list.rays.size());
  const Judge<Real> judge{black.data(), background.empty() ? nullptr : background.data(), nullptr, 0};
  auto field = march.field_forward(x, judge);
  const auto y = random_quads<Real>(list.rays.size(), 6);
  const double left = dot(field.residual, y) - dot(march.field_forward(dark, judge).residual, y);
  field.residual = y;
  const double right = dot(x, march.field_adjoint(field));
  ASSERT_GT(left, 10);
  EXPECT_NEAR(left / right, 1, kBound<Real>) << "sigma " << sigma;
}

template <class Real>
void expect_transposes(bool curved) {
  const MarchCase c = march_case({.curved = curved});
  ASSERT_EQ(c.list.bends.empty(), !curved);
  for (const auto& background : {std::vector<Rgba>{}, random_quads<float>(c.list.rays.size(), 7)}) {
    for (const double sigma : kExtinctions) {
      expect_transpose<Real>(c.list, sigma, background);
      expect_transpose_of_field<Real>(c.list, sigma, background);
    }
  }
}

TEST(Adjoint, OfStraightRaysIsTheTransposeInSinglePrecision) { expect_transposes<float>(false); }
TEST(Adjoint, OfStraightRaysIsTheTransposeInDoublePrecision) { expect_transposes<double>(false); }
TEST(Adjoint, OfCurvedRaysIsTheTransposeInSinglePrecision) { expect_transposes<float>(true); }
TEST(Adjoint, OfCurvedRaysIsTheTransposeInDoublePrecision) { expect_transposes<double>(true); }

}  // namespace
}  // namespace emberlock
