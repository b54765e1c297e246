// SPDX-License-Identifier: Apache-2.0
// Every level of vector instructions that this CPU runs gives what the baseline gives, but for rounding.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/march_case.h"

namespace emberlock::recon {
namespace {

template <class Real>
constexpr double kLargestDifference = sizeof(Real) == sizeof(float) ? 1e-5 : 1e-12;

template <class Real>
void expect_same(const std::vector<Quad<Real>>& a, const std::vector<Quad<Real>>& b, const char* what) {
  double difference = 0;
  double largest = 0;
  for (std::size_t i = 0; i < b.size(); ++i)
    for (int c = 0; c < 4; ++c) {
      difference = std::max(difference, std::abs(static_cast<double>(a[i].c[c] - b[i].c[c])));
      largest = std::max(largest, std::abs(static_cast<double>(b[i].c[c])));
    }
  EXPECT_GT(largest, 0) << what;
  EXPECT_LE(difference, kLargestDifference<Real> * largest) << what;
}

template <class Real>
void expect_same_marches(const MarchTable<Real>& table, bool curved) {
  const MarchCase c = march_case({.curved = curved});
  const Marcher<Real> level(c.list, table);
  const Marcher<Real> baseline(c.list, march_table<Real>(Isa::baseline));
  const auto x = random_quads<Real>(c.list.grid.size(), 1, 1, 0.5);
  const auto y = random_quads<Real>(c.list.rays.size(), 2);
  const auto seen = random_quads<float>(c.list.rays.size(), 3);
  const PixelResidual<Real> residual_of{seen.data(), seen.data(), nullptr, 0};
  constexpr auto kSigma = static_cast<Real>(0.1);
  for (const Absorb absorb : {Absorb::nothing, Absorb::constant, Absorb::field})
    expect_same(level.forward(absorb, x, kSigma), baseline.forward(absorb, x, kSigma), "forward");
  for (const Absorb absorb : {Absorb::nothing, Absorb::constant})
    expect_same(level.adjoint(absorb, y, kSigma), baseline.adjoint(absorb, y, kSigma), "adjoint");
  const auto field = level.field_forward(x, residual_of);
  const auto truth = baseline.field_forward(x, residual_of);
  expect_same(field.residual, truth.residual, "field residual");
  expect_same(level.field_adjoint(field), baseline.field_adjoint(truth), "field gradient");
}

/// One look-ahead and one solution after a step of either kind under renewed ties, x and y one behind the
/// other.
template <class Real>
std::vector<Quad<Real>> stepped(const MarchTable<Real>& table, bool field) {
  Grid g;
  g.nx = 37;
  g.ny = g.nz = 5;
  const std::vector<Real> weights(g.size(), Real(0.7));
  const std::vector<Real> reference(g.size(), Real(0.1));
  auto x = random_quads<Real>(g.size(), 1, 1, 0.3);
  const auto y = random_quads<Real>(g.size(), 2, 1, 0.3);
  auto next = y;
  auto gradient = random_quads<Real>(g.size(), 3, 1, 0.1);
  std::vector<Real> stiffness(g.size());
  const Stiffen<Real> ties{g, weights.data(), y.data(), stiffness.data(), Real(0.01), Real(0.1)};
  const Descend<Real> emission{g,           weights.data(),  x.data(),         y.data(),
                               next.data(), gradient.data(), stiffness.data(), Real(2),
                               Real(0.9)};
  const DescendField<Real> both{emission, weights.data(), reference.data(), Real(0.1), Real(0.01), Real(0.3)};
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j) table.stiffen(ties, 0, g.nx, j, k);
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      field ? table.field_update(both, 0, g.nx, j, k) : table.update(emission, 0, g.nx, j, k);
  x.insert(x.end(), next.begin(), next.end());
  return x;
}

/// Those above the baseline that this CPU runs.
std::vector<Isa> levels() {
  std::vector<Isa> all{Isa::v2, Isa::v3, Isa::v4};
  std::erase_if(all, [](Isa level) { return level > best_isa(); });
  return all;
}

class IsaTest : public testing::TestWithParam<Isa> {};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(IsaTest);

TEST_P(IsaTest, MarchesAsTheBaselineDoes) {
  for (const bool curved : {false, true}) {
    expect_same_marches(march_table<float>(GetParam()), curved);
    expect_same_marches(march_table<double>(GetParam()), curved);
  }
}

TEST_P(IsaTest, StepsAsTheBaselineDoes) {
  for (const bool field : {false, true}) {
    expect_same(stepped(march_table<float>(GetParam()), field),
                stepped(march_table<float>(Isa::baseline), field), "step");
    expect_same(stepped(march_table<double>(GetParam()), field),
                stepped(march_table<double>(Isa::baseline), field), "step");
  }
}

INSTANTIATE_TEST_SUITE_P(Levels, IsaTest, testing::ValuesIn(levels()), [](const auto& level) {
  return "v" + std::to_string(static_cast<int>(level.param) + 1);
});

}  // namespace
}  // namespace emberlock::recon
