// SPDX-License-Identifier: Apache-2.0
// The parts of the flame simulator against closed forms: advection, transport, the pressure's equation.
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "recon/kernels/fluid_diffusion.h"
#include "recon/kernels/fluid_refine.h"
#include "recon/kernels/fluid_transport.h"
#include "recon/synthetic/fluid_work.h"
#include "recon/synthetic/pressure_solver.h"
#include "tests/support/devices.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(Fluid);
ON_EACH_DEVICE(FluidSlow);

constexpr double kPi = std::numbers::pi;
constexpr double kLeastOrder = 1.8;

double order(double coarse, double fine) { return std::log2(coarse / fine); }

/// Calls act(i, j, k) at each cell and `beyond` cells around them.
template <class Act>
void each_cell(const FluidGrid& grid, const Act& act, int beyond = 0) {
  for (int k = -beyond; k < grid.nz + beyond; ++k)
    for (int j = -beyond; j < grid.ny + beyond; ++j)
      for (int i = -beyond; i < grid.nx + beyond; ++i) act(i, j, k);
}

/// A blob that turns a quarter around the middle of a flat box of side 1.
struct TurningBlob {
  FluidGrid grid;
  FluidWork work;
  FluidArray<float> u, v, w;

  TurningBlob(int n, const ComputeOptions& compute)
      : grid{n, n, 8, 1.F / static_cast<float>(n)}, work(compute) {
    std::vector<float> x(grid.size()), y(grid.size());
    const auto turn = [&](int i, int j, int k) {
      x[grid.index(i, j, k)] = static_cast<float>(-((j + 0.5) / n - 0.5));
      y[grid.index(i, j, k)] = static_cast<float>((i + 0.5) / n - 0.5);
    };
    each_cell(grid, turn, 1);
    for (FluidArray<float>* a : {&u, &v, &w}) *a = work.array<float>(grid.size());
    u.fill(x);
    v.fill(y);
  }
  [[nodiscard]] ConstFaceFields velocity() const { return {{u.data(), v.data(), w.data()}}; }
  /// After an angle.
  [[nodiscard]] std::vector<float> blob(double angle) const {
    std::vector<float> f(grid.size());
    const auto light = [&](int i, int j, int k) {
      const double dx = (i + 0.5) / grid.nx - 0.5 - 0.15 * std::cos(angle);
      const double dy = (j + 0.5) / grid.ny - 0.5 - 0.15 * std::sin(angle);
      f[grid.index(i, j, k)] = static_cast<float>(std::exp(-(dx * dx + dy * dy) / (2 * 0.07 * 0.07)));
    };
    each_cell(grid, light, 1);
    return f;
  }
  /// Mean of |value - truth| over the middle layer's cells, but for the blob's top: both methods give up
  /// their second order at extremes, so as to make no new ones.
  [[nodiscard]] double error(const std::vector<float>& values, double angle) const {
    const std::vector<float> truth = blob(angle);
    double sum = 0;
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const std::size_t c = grid.index(i, j, grid.nz / 2);
        if (truth[c] > 0.8F) continue;
        sum += std::abs(static_cast<double>(values[c]) - static_cast<double>(truth[c]));
      }
    return sum / (grid.nx * grid.ny);
  }
};

double mac_cormack_error(int n) {
  TurningBlob turn(n, {device_here(), 1});
  const int steps = n;
  const auto cells = static_cast<float>(kPi / 2 / steps * n);
  FluidArray<float> in = turn.work.array<float>(turn.grid.size());
  in.fill(turn.blob(0));
  FluidArray<float> hat = turn.work.array<float>(turn.grid.size());
  FluidArray<float> out = turn.work.array<float>(turn.grid.size());
  for (int s = 0; s < steps; ++s) {
    turn.work.cells(turn.grid,
                    TraceBack<float, -1>{in.data(), hat.data(), turn.velocity(), turn.grid, cells});
    turn.work.cells(turn.grid, CorrectTrace<float, -1>{in.data(), hat.data(), out.data(), turn.velocity(),
                                                       turn.grid, cells});
    in.swap(out);
  }
  return turn.error(in.values(), kPi / 2);
}

void expect_second_order(double (*error)(int cells)) {
  const double e[3] = {error(32), error(64), error(128)};
  EXPECT_GE(order(e[0], e[1]), kLeastOrder);
  EXPECT_GE(order(e[1], e[2]), kLeastOrder);
}

TEST_P(FluidSlow, MacCormackIsOfSecondOrder) { expect_second_order(mac_cormack_error); }

/// A slope, in units of the finer grid's cells, at the middle of a cell or a face.
template <int Axis>
float slope(float i, float j, float k) {
  return 3 + 2 * (i + (Axis == 0 ? 0 : 0.5F)) - (j + (Axis == 1 ? 0 : 0.5F)) +
         0.5F * (k + (Axis == 2 ? 0 : 0.5F));
}

template <int Axis>
void expect_refined() {
  FluidWork work({device_here(), 1});
  const FluidGrid from{8, 16, 8, 1};
  const FluidGrid to{16, 32, 16, 0.5F};
  std::vector<float> values(from.size());
  const auto twice = [](int at, int axis) { return 2 * static_cast<float>(at) + (Axis == axis ? 0 : 0.5F); };
  for (int k = -1; k <= 9; ++k)
    for (int j = -1; j <= 17; ++j)
      for (int i = -1; i <= 9; ++i)
        values[from.index(i, j, k)] = slope<Axis>(twice(i, 0), twice(j, 1), twice(k, 2));
  FluidArray<float> coarse = work.array<float>(from.size());
  coarse.fill(values);
  FluidArray<float> fine = work.array<float>(to.size());
  const Refine<float, Axis> refine{coarse.data(), fine.data(), from, to};
  if constexpr (Axis < 0)
    work.cells(to, refine);
  else
    work.faces<Axis>(to, refine);
  const std::vector<float> got = fine.values();
  const int beyond[3] = {Axis == 0 ? 1 : 0, Axis == 1 ? 1 : 0, Axis == 2 ? 1 : 0};
  for (int k = 1; k < to.nz + beyond[2]; ++k)  // the lowest takes what is above the floor
    for (int j = 0; j < to.ny + beyond[1]; ++j)
      for (int i = 0; i < to.nx + beyond[0]; ++i)
        ASSERT_FLOAT_EQ(got[to.index(i, j, k)],
                        slope<Axis>(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)))
            << Axis << ": " << i << " " << j << " " << k;
  if (Axis == 2) {
    EXPECT_EQ(got[to.index(3, 3, 0)], 0) << "the floor's faces are the burners'";
  }
}

TEST_P(Fluid, ASlopeIsTheSameOnAGridTwiceAsFine) {
  expect_refined<-1>();
  expect_refined<0>();
  expect_refined<1>();
  expect_refined<2>();
}

double transport_error(int n) {
  TurningBlob turn(n, {device_here(), 1});
  const int steps = 2 * n;
  const auto cells = static_cast<float>(kPi / 2 / steps * n);
  const std::size_t size = turn.grid.size();
  FluidArray<float> in = turn.work.array<float>(size);
  in.fill(turn.blob(0));
  FluidArray<float> stage = turn.work.array<float>(size);
  FluidArray<float> out = turn.work.array<float>(size);
  FluidArray<Rgba> gas = turn.work.array<Rgba>(size);
  Rgba air;
  air.c[0] = 300;
  gas.fill(std::vector<Rgba>(size, air));
  FluidArray<Rgba> still = turn.work.array<Rgba>(size);  // air turns into air
  const auto act = [&](const float* from, float* to, float keep) {
    turn.work.cells(turn.grid, Transport{gas.data(), gas.data(), still.data(), in.data(), from, to,
                                         turn.velocity(), turn.grid, air, cells, keep});
  };
  for (int s = 0; s < steps; ++s) {
    act(in.data(), stage.data(), 0.F);
    act(stage.data(), out.data(), 0.5F);
    in.swap(out);
  }
  return turn.error(in.values(), kPi / 2);
}

TEST_P(FluidSlow, TransportIsOfSecondOrder) { expect_second_order(transport_error); }

/// q = sin(pi x) sin(pi y) cos(pi z / 2) is 0 at the open sides and flat at the floor of the unit cube.
struct PoissonCase {
  double error = 0;
  PressureSolver::Outcome outcome;
};
PoissonCase poisson(int n, double hot) {
  const FluidGrid grid{n, n, n, 1.F / static_cast<float>(n)};
  FluidWork work({Device::cpu, 1});
  PressureSolver solver(grid, work);
  std::vector<Rgba> gas(grid.size());
  for (Rgba& g : gas) g.c[0] = static_cast<float>(hot);
  const PressureEquation& equation = solver.equation();
  work.faces<0>(grid, FaceCoefficients<0>{gas.data(), grid, equation.a.axis[0], 1.F / 300});
  work.faces<1>(grid, FaceCoefficients<1>{gas.data(), grid, equation.a.axis[1], 1.F / 300});
  work.faces<2>(grid, FaceCoefficients<2>{gas.data(), grid, equation.a.axis[2], 1.F / 300});
  solver.prepare();
  const auto truth = [&](int i, int j, int k) {
    return std::sin(kPi * (i + 0.5) / n) * std::sin(kPi * (j + 0.5) / n) * std::cos(kPi / 2 * (k + 0.5) / n);
  };
  const double factor = hot / 300 * (2 + 0.25) * kPi * kPi / n / n;
  each_cell(grid, [&](int i, int j, int k) {
    solver.b()[grid.index(i, j, k)] = static_cast<float>(factor * truth(i, j, k));
  });
  PoissonCase result;
  result.outcome = solver.solve(1e-5, 50);
  double square = 0;
  each_cell(grid, [&](int i, int j, int k) {
    square += std::pow(static_cast<double>(solver.q()[grid.index(i, j, k)]) - truth(i, j, k), 2);
  });
  result.error = std::sqrt(square / std::pow(n, 3));
  return result;
}

TEST(PressureSolverTest, MeetsTheClosedFormWithSecondOrder) {
  for (const double hot : {300.0, 2000.0}) {
    const PoissonCase e[3] = {poisson(8, hot), poisson(16, hot), poisson(32, hot)};
    EXPECT_GE(order(e[0].error, e[1].error), kLeastOrder);
    EXPECT_GE(order(e[1].error, e[2].error), kLeastOrder);
    EXPECT_LT(e[2].error, 1e-3);
  }
}

TEST(PressureSolverTest, NeedsAsManyIterationsOnAnyGrid) {
  for (const int n : {8, 16, 24, 40, 64}) {
    const PoissonCase c = poisson(n, 300);
    EXPECT_LE(c.outcome.iterations, 12) << n;
    EXPECT_LE(c.outcome.residual, 1e-5) << n;
  }
}

TEST(PressureSolverTest, NothingToDoIsNoIteration) {
  const FluidGrid grid{8, 8, 8, 1};
  FluidWork work({Device::cpu, 1});
  PressureSolver solver(grid, work);
  EXPECT_EQ(solver.solve(1e-5, 50).iterations, 0);
}

/// By mass: the sum of density * value stays.
TEST_P(Fluid, DiffusionKeepsEveryGram) {
  const FluidGrid grid{16, 16, 16, 0.01F};
  FluidWork work({device_here(), 1});
  std::vector<Rgba> gas(grid.size());
  for (Rgba& g : gas) g.c[0] = 300;
  for (int k = 6; k < 10; ++k)
    for (int j = 6; j < 10; ++j)
      for (int i = 6; i < 10; ++i) {
        gas[grid.index(i, j, k)].c[0] = 1800;
        gas[grid.index(i, j, k)].c[1] = 1;
      }
  FluidArray<Rgba> in = work.array<Rgba>(grid.size());
  in.fill(gas);
  FluidArray<Rgba> out = work.array<Rgba>(grid.size());
  FluidArray<float> particles = work.array<float>(grid.size());
  std::vector<float> alike(grid.size());
  for (std::size_t c = 0; c < grid.size(); ++c) alike[c] = gas[c].c[1];
  particles.fill(alike);
  FluidArray<float> particles_out = work.array<float>(grid.size());
  FluidArray<float> expansion = work.array<float>(grid.size());
  work.cells(grid, DiffuseGas{in.data(), out.data(), particles.data(), particles_out.data(), expansion.data(),
                              nullptr, grid, 0.05F, 10});
  const std::vector<Rgba> after = out.values();
  const std::size_t edge = grid.index(6, 8, 8);
  EXPECT_EQ(particles_out.values()[edge], after[edge].c[1]) << "all that is carried goes alike";
  EXPECT_NEAR(expansion.values()[edge], 10 * (after[edge].c[0] / 1800 - 1), 1e-5);
  EXPECT_LT(expansion.values()[edge], 0) << "hot gas shrinks";
  double before_mass = 0;
  double after_mass = 0;
  each_cell(grid, [&](int i, int j, int k) {
    const std::size_t c = grid.index(i, j, k);
    const double density = 1 / static_cast<double>(gas[c].c[0]);
    before_mass += density * static_cast<double>(gas[c].c[1]);
    after_mass += density * static_cast<double>(after[c].c[1]);
  });
  EXPECT_NEAR(after_mass, before_mass, 1e-6 * before_mass);
}

}  // namespace
}  // namespace emberlock::recon
