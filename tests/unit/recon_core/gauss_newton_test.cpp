// SPDX-License-Identifier: Apache-2.0
// The parabola near a volume against one of double-precision marches, column by column.
#include "recon/adjust/gauss_newton.h"

#include <array>
#include <cmath>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "base/random.h"
#include "tests/support/key_points.h"
#include "tests/support/march_case.h"
#include "tests/support/posed_scene.h"

namespace emberlock::recon {
namespace {

using Points = GaussNewton::Points;

Effects with_extinction(Extinction::Model model) {
  Effects effects;
  if (model != Extinction::Model::none) effects.extinction = {model, PerMeter(8), PerMeter(0)};
  return effects;
}

/// A ball of light on 5 key points along each edge, after some passes.
class GaussNewtonTest : public testing::TestWithParam<Extinction::Model> {
 protected:
  GaussNewtonTest()
      : effects_(with_extinction(GetParam())),
        posed_(Device::cpu, ball_of(24), 4, 1, effects_),
        descent_(begun(posed_.setup)) {
    for (int pass = 0; pass < 6; ++pass) descent_.pass();
    x_ = descent_.engine().get();
    if (field())
      for (std::size_t p = 0; p < x_.size(); ++p)
        x_[p].c[3] *= 0.5F + static_cast<float>(random_uniform(1, 0, p));
    x_[7].c[1] = 0;  // held
    ties_at_ = begun_at();
  }
  [[nodiscard]] bool field() const { return GetParam() == Extinction::Model::field; }
  [[nodiscard]] Descent begun(const SolverSetup& setup) const {
    return {posed_.level,
            setup.optics(posed_.hull.grid),
            setup,
            {nullptr, field() ? &effects_.extinction : nullptr}};
  }
  [[nodiscard]] int lanes() const { return field() ? 4 : 3; }
  [[nodiscard]] std::size_t size() const { return x_.size() * static_cast<std::size_t>(lanes()); }

  struct TiesAt {
    Descent::Ties ties;
    std::vector<float> weights;
    Points expected;
  };
  [[nodiscard]] TiesAt begun_at() const {
    const auto light = make_engine(posed_.level.problem, posed_.setup.optics(posed_.hull.grid),
                                   Precision::float32, posed_.setup.pool);
    light->set(x_);
    Descent at(posed_.level, posed_.setup.optics(posed_.hull.grid), posed_.setup,
               {light.get(), field() ? &effects_.extinction : nullptr});
    if (field()) at.release_extinction();
    return {at.ties(), at.engine().weights(), at.engine().get()};
  }

  [[nodiscard]] std::vector<Quad<double>> shown(const std::vector<Quad<double>>& x) const {
    const Marcher<double> march(posed_.level.problem.list);
    const std::vector<Rgba> nothing(posed_.level.problem.rays());
    if (field()) return march.field_forward(x, {nothing.data()}).residual;
    const bool constant = GetParam() == Extinction::Model::constant;
    return march.forward(constant ? Absorb::constant : Absorb::nothing, x,
                         static_cast<double>(posed_.setup.sigma(posed_.hull.grid)));
  }
  /// Of the rays that are fitted.
  [[nodiscard]] Eigen::VectorXd of_rays(const std::vector<Quad<double>>& rays) const {
    const std::size_t fitted = posed_.level.problem.list.subset_begin[1];
    Eigen::VectorXd out(static_cast<Eigen::Index>(3 * fitted));
    for (std::size_t r = 0; r < fitted; ++r)
      for (int c = 0; c < 3; ++c) out[static_cast<Eigen::Index>(3 * r) + c] = rays[r].c[c];
    return out;
  }
  [[nodiscard]] Eigen::VectorXd flat(const Points& points) const {
    Eigen::VectorXd out(static_cast<Eigen::Index>(size()));
    for (std::size_t p = 0; p < points.size(); ++p)
      for (int c = 0; c < lanes(); ++c)
        out[static_cast<Eigen::Index>(p) * lanes() + c] = static_cast<double>(points[p].c[c]);
    return out;
  }

  /// Of the lanes that move; a central difference is exact for emission, good to 1e-9 for extinction.
  [[nodiscard]] Eigen::MatrixXd jacobian(const GaussNewton& of) const {
    const std::vector<Quad<double>> x = converted<double>(x_);
    Eigen::MatrixXd j =
        Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * posed_.level.problem.list.subset_begin[1]),
                              static_cast<Eigen::Index>(size()));
    constexpr double kWay = 1e-4;
    for (std::size_t p = 0; p < x.size(); ++p)
      for (int c = 0; c < lanes(); ++c) {
        if (!of.moves(p, c)) continue;
        std::vector<Quad<double>> above = x;
        std::vector<Quad<double>> below = x;
        above[p].c[c] += kWay;
        below[p].c[c] -= kWay;
        j.col(static_cast<Eigen::Index>(p) * lanes() + c) =
            (of_rays(shown(above)) - of_rays(shown(below))) / (2 * kWay);
      }
    return j;
  }
  /// Of Stiffen and DescendField, as their comments have them.
  [[nodiscard]] Eigen::MatrixXd ties(const GaussNewton& of) const {
    const Grid& g = posed_.level.problem.grid();
    const auto n = static_cast<Eigen::Index>(size());
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, n);
    const auto each_neighbour = [&](int i, int j, int k, const auto& act) {
      constexpr std::array<std::array<int, 3>, 6> kWays = {
          {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};
      for (const auto& way : kWays) {
        const int a = i + way[0];
        const int b = j + way[1];
        const int c = k + way[2];
        const bool inside = a >= 0 && b >= 0 && c >= 0 && a < g.nx && b < g.ny && c < g.nz;
        act(inside ? g.index(a, b, c) : 0, inside);
      }
    };
    std::vector<double> stiff(x_.size());
    each_point(g, [&](int i, int j, int k, std::size_t p) {
      double squares = 0;
      each_neighbour(i, j, k, [&](std::size_t q, bool inside) {
        for (int c = 0; c < 3; ++c)
          squares += std::pow(static_cast<double>(x_[p].c[c] - (inside ? x_[q].c[c] : 0)), 2);
      });
      const double steep = std::sqrt(squares / 6);
      const auto soft = static_cast<double>(ties_at_.ties.soft);
      if (ties_at_.weights[p] > 0)
        stiff[p] = static_cast<double>(ties_at_.ties.most) / 2 * std::min(1.0, soft / steep);
    });
    each_point(g, [&](int i, int j, int k, std::size_t p) {
      each_neighbour(i, j, k, [&](std::size_t q, bool inside) {
        for (int c = 0; c < lanes(); ++c) {
          double t = inside ? stiff[p] + stiff[q] : stiff[p];
          if (c == 3) {
            const double beyond = static_cast<double>(x_[p].c[3] - ties_at_.expected[p].c[3] -
                                                      (x_[q].c[3] - ties_at_.expected[q].c[3]));
            t = inside && ties_at_.weights[q] > 0
                    ? static_cast<double>(ties_at_.ties.field->variation) /
                          std::max(std::abs(beyond), static_cast<double>(ties_at_.ties.field->soft))
                    : 0;
          }
          const Eigen::Index a = static_cast<Eigen::Index>(p) * lanes() + c;
          const Eigen::Index b = static_cast<Eigen::Index>(q) * lanes() + c;
          if (!of.moves(p, c)) continue;
          out(a, a) += t;
          if (inside && of.moves(q, c)) out(a, b) -= t;
        }
      });
    });
    return out;
  }

  Effects effects_;
  Posed posed_;
  Descent descent_;
  Points x_;
  TiesAt ties_at_;
};
using GaussNewtonTestSlow = GaussNewtonTest;

INSTANTIATE_TEST_SUITE_P(Extinctions, GaussNewtonTest,
                         testing::Values(Extinction::Model::none, Extinction::Model::constant,
                                         Extinction::Model::field));
INSTANTIATE_TEST_SUITE_P(Extinctions, GaussNewtonTestSlow,
                         testing::Values(Extinction::Model::none, Extinction::Model::constant,
                                         Extinction::Model::field));

TEST_P(GaussNewtonTestSlow, IsTheHessianOfDoublePrecisionMarches) {
  GaussNewton hessian(posed_.level, posed_.setup, x_);
  EXPECT_FALSE(hessian.moves(7, 1));
  const Eigen::MatrixXd j = jacobian(hessian);
  const Points rays = random_quads<float>(posed_.level.problem.rays(), 5);
  const Eigen::VectorXd pulled = j.transpose() * of_rays(converted<double>(rays));
  EXPECT_LT((flat(hessian.transpose(rays)) - pulled).norm() / pulled.norm(), 1e-4);

  const Eigen::MatrixXd h = j.transpose() * j + ties(hessian);
  Points d = random_quads<float>(x_.size(), 6, 1, 0.01);
  for (std::size_t p = 0; p < d.size(); ++p)
    for (int c = 0; c < 4; ++c)
      if (!hessian.moves(p, c)) d[p].c[c] = 0;
  const Eigen::VectorXd expected = h * flat(d);
  EXPECT_LT((flat(hessian.apply(d)) - expected).norm() / expected.norm(), field() ? 3e-3 : 1e-4);
}

TEST_P(GaussNewtonTestSlow, IsInvertedByConjugateGradients) {
  GaussNewton hessian(posed_.level, posed_.setup, x_);
  const Eigen::MatrixXd j = jacobian(hessian);
  Eigen::MatrixXd h = j.transpose() * j + ties(hessian);
  for (Eigen::Index i = 0; i < h.rows(); ++i)
    if (h(i, i) == 0) h(i, i) = 1;  // held
  const Points b = hessian.transpose(random_quads<float>(posed_.level.problem.rays(), 7));
  const Eigen::VectorXd expected = h.ldlt().solve(flat(b));
  const GaussNewton::Solved solved = hessian.solve(b, 1e-4, 500);
  EXPECT_GT(solved.steps, 5);
  EXPECT_LT((flat(solved.x) - expected).norm() / expected.norm(), field() ? 0.02 : 2e-3);
  EXPECT_EQ(solved.x[7].c[1], 0) << "held";
  EXPECT_EQ(hessian.solve(b, 1e-4, 3).steps, 3);
  EXPECT_EQ(hessian.solve(Points(x_.size()), 1e-4, 500).steps, 0) << "nothing pulls";
}

/// The mean of many squares is the variance that the ties' matrix says.
TEST_P(GaussNewtonTest, NoiseOfTiesHasTheirCovariance) {
  GaussNewton hessian(posed_.level, posed_.setup, x_);
  const Eigen::MatrixXd t = ties(hessian);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(size()));
  Eigen::VectorXd across = squares;  // of neighbours along x
  constexpr std::uint64_t kDraws = 1000;
  for (std::uint64_t draw = 0; draw < kDraws; ++draw) {
    const Eigen::VectorXd v = flat(hessian.tie_noise(2, 3, draw));
    squares += v.cwiseAbs2() / (4.0 * kDraws);
    across.head(v.size() - lanes()) +=
        v.head(v.size() - lanes()).cwiseProduct(v.tail(v.size() - lanes())) / (4.0 * kDraws);
  }
  EXPECT_NEAR(squares.sum() / t.trace(), 1, 0.02);
  EXPECT_NEAR((squares - t.diagonal()).norm() / t.diagonal().norm(), 0, 0.12);
  Eigen::VectorXd beside = Eigen::VectorXd::Zero(squares.size());
  for (Eigen::Index i = 0; i + lanes() < t.rows(); ++i) beside[i] = t(i, i + lanes());
  EXPECT_NEAR(across.sum() / beside.sum(), 1, 0.05) << "what pulls one end pushes the other";
}

TEST_P(GaussNewtonTest, ABoundThatIsMetPullsNothing) {
  Points brighter = x_;
  for (Rgba& q : brighter)
    for (int c = 0; c < 3; ++c) q.c[c] *= 1.2F;
  SolverSetup bounded = posed_.setup;
  bounded.effects.sensor.clipping = Sensor::Clipping::at_white;
  bounded.effects.sensor.white = 5;  // of a ball of 200 levels
  const Points rays(posed_.level.problem.rays(), Rgba{{1, 1, 1, 0}});
  const double pull = flat(GaussNewton(posed_.level, bounded, brighter).transpose(rays)).norm();
  EXPECT_GT(pull, 0);
  EXPECT_LT(pull, 0.75 * flat(GaussNewton(posed_.level, posed_.setup, brighter).transpose(rays)).norm());
}

}  // namespace
}  // namespace emberlock::recon
