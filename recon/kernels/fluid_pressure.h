// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/kernels/fluid_advect.h"
#include "recon/kernels/fluid_grid.h"

namespace emberlock::recon {

// The Poisson equation of a projection, and the passes of its multigrid. In cell c with neighbours n it is
//   sum over faces f of a_f (q_c - q_n) = b_c,
// where a_f = T / T_outside is the inverse density at the face, relative to still air, q = p dt / (density
// edge), m/s, and b = edge * (wanted - present divergence), m/s. At open faces q is 0 half a cell away, so
// a_f is doubled; at the floor a_f is 0. On a coarser grid a face has the area of four and twice the
// distance, so its a_f is half the sum of theirs, and b is the sum over eight cells.

/// What belongs to one grid of the multigrid. q of the layer outside is always 0.
struct PressureEquation {
  FluidGrid grid;
  FaceFields a;                       ///< a_f
  float* inverse_diagonal = nullptr;  ///< 1 / sum of the six a_f

  [[nodiscard]] HOST_DEVICE float neighbours(const float* q, std::size_t c) const {
    const std::size_t y = grid.stride_y();
    const std::size_t z = grid.stride_z();
    return (a.axis[0][c] * q[c - 1] + a.axis[0][c + 1] * q[c + 1]) +
           (a.axis[1][c] * q[c - y] + a.axis[1][c + y] * q[c + y]) +
           (a.axis[2][c] * q[c - z] + a.axis[2][c + z] * q[c + z]);
  }
  [[nodiscard]] HOST_DEVICE float diagonal(std::size_t c) const {
    return (a.axis[0][c] + a.axis[0][c + 1]) + (a.axis[1][c] + a.axis[1][c + grid.stride_y()]) +
           (a.axis[2][c] + a.axis[2][c + grid.stride_z()]);
  }
  /// (A q)_c
  [[nodiscard]] HOST_DEVICE float apply(const float* q, std::size_t c) const {
    const std::size_t y = grid.stride_y();
    const std::size_t z = grid.stride_z();
    const float here = q[c];
    return (a.axis[0][c] * (here - q[c - 1]) + a.axis[0][c + 1] * (here - q[c + 1])) +
           (a.axis[1][c] * (here - q[c - y]) + a.axis[1][c + y] * (here - q[c + y])) +
           (a.axis[2][c] * (here - q[c - z]) + a.axis[2][c + z] * (here - q[c + z]));
  }
};

/// Sets a_f of the faces of an axis from what cells hold: four lanes, of which the first is the temperature.
template <int Axis>
struct FaceCoefficients {
  const Rgba* state = nullptr;
  FluidGrid grid;
  float* a = nullptr;
  float per_kelvin = 0;  ///< 1 / temperature outside

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    const int at = Axis == 0 ? i : Axis == 1 ? j : k;
    const int last = Axis == 0 ? grid.nx : Axis == 1 ? grid.ny : grid.nz;
    const float before = state[c - grid.template stride<Axis>()].c[0];
    const float here = state[c].c[0];
    if (at == 0)
      a[c] = Axis == 2 ? 0.F : 2.F * here * per_kelvin;
    else if (at == last)
      a[c] = 2.F * before * per_kelvin;
    else
      a[c] = 0.5F * (before + here) * per_kelvin;
  }
};

template <int Axis>
struct CoarsenCoefficients {
  PressureEquation fine;
  PressureEquation coarse;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    constexpr int kAcross = Axis == 0 ? 1 : 0;
    constexpr int kOther = Axis == 2 ? 1 : 2;
    const std::size_t p = fine.grid.index(2 * i, 2 * j, 2 * k);
    const std::size_t s = fine.grid.template stride<kAcross>();
    const std::size_t t = fine.grid.template stride<kOther>();
    const float* a = fine.a.axis[Axis];
    coarse.a.axis[Axis][coarse.grid.index(i, j, k)] = 0.5F * ((a[p] + a[p + s]) + (a[p + t] + a[p + s + t]));
  }
};

struct InvertDiagonal {
  PressureEquation equation;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = equation.grid.index(i, j, k);
    equation.inverse_diagonal[c] = 1.F / equation.diagonal(c);
  }
};

/// b = edge * (wanted - present divergence); `wanted`, 1/s, may be absent: 0.
struct DivergenceError {
  ConstFaceFields velocity;
  const float* wanted = nullptr;
  FluidGrid grid;
  float* b = nullptr;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    const float out = (velocity.axis[0][c + 1] - velocity.axis[0][c]) +
                      (velocity.axis[1][c + grid.stride_y()] - velocity.axis[1][c]) +
                      (velocity.axis[2][c + grid.stride_z()] - velocity.axis[2][c]);
    b[c] = (wanted == nullptr ? 0.F : grid.edge * wanted[c]) - out;
  }
};

/// velocity -= a_f (q_c - q_before), at the faces of an axis.
template <int Axis>
struct SubtractGradient {
  PressureEquation equation;
  const float* q = nullptr;
  float* velocity = nullptr;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = equation.grid.index(i, j, k);
    velocity[c] -= equation.a.axis[Axis][c] * (q[c] - q[c - equation.grid.template stride<Axis>()]);
  }
};

/// Gauss-Seidel at the cells of one colour: i + j + k even (0) or odd (1). i counts these cells of a row.
struct RelaxColour {
  PressureEquation equation;
  const float* b = nullptr;
  float* q = nullptr;
  int colour = 0;

  HOST_DEVICE void operator()(int half, int j, int k) const {
    const int i = 2 * half + ((j + k + colour) & 1);
    if (i >= equation.grid.nx) return;
    const std::size_t c = equation.grid.index(i, j, k);
    q[c] = (b[c] + equation.neighbours(q, c)) * equation.inverse_diagonal[c];
  }
};

/// The same at both colours, the even cells first, when q is 0: in one pass, where an even neighbour's q is
/// its b over its diagonal. i counts pairs of cells of a row.
struct RelaxFirst {
  PressureEquation equation;
  const float* b = nullptr;
  float* q = nullptr;

  [[nodiscard]] HOST_DEVICE float even(std::size_t c) const { return b[c] * equation.inverse_diagonal[c]; }
  HOST_DEVICE void operator()(int half, int j, int k) const {
    const std::size_t y = equation.grid.stride_y();
    const std::size_t z = equation.grid.stride_z();
    const FaceFields& a = equation.a;
    const int first = 2 * half + ((j + k) & 1);
    if (first < equation.grid.nx) {
      const std::size_t c = equation.grid.index(first, j, k);
      q[c] = even(c);
    }
    const int second = 2 * half + ((j + k + 1) & 1);
    if (second >= equation.grid.nx) return;
    const std::size_t c = equation.grid.index(second, j, k);
    const float neighbours = (a.axis[0][c] * even(c - 1) + a.axis[0][c + 1] * even(c + 1)) +
                             (a.axis[1][c] * even(c - y) + a.axis[1][c + y] * even(c + y)) +
                             (a.axis[2][c] * even(c - z) + a.axis[2][c + z] * even(c + z));
    q[c] = (b[c] + neighbours) * equation.inverse_diagonal[c];
  }
};

/// The coarse b: the sum of the residuals of eight cells. After a pass over the odd cells theirs are 0.
struct RestrictResidual {
  PressureEquation fine;
  const float* q = nullptr;
  const float* b = nullptr;
  FluidGrid coarse;
  float* coarse_b = nullptr;

  [[nodiscard]] HOST_DEVICE float residual(std::size_t c) const { return b[c] - fine.apply(q, c); }
  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t p = fine.grid.index(2 * i, 2 * j, 2 * k);
    const std::size_t y = fine.grid.stride_y();
    const std::size_t z = fine.grid.stride_z();
    coarse_b[coarse.index(i, j, k)] =
        (residual(p) + residual(p + 1 + y)) + (residual(p + 1 + z) + residual(p + y + z));
  }
};

/// q += the coarse q, linear between the centres of coarse cells: its mirror image beyond the floor, minus
/// its mirror image beyond open sides. i counts pairs of cells of a row.
struct ProlongCorrection {
  FluidGrid coarse;
  const float* coarse_q = nullptr;
  FluidGrid fine;
  float* q = nullptr;

  HOST_DEVICE void operator()(int x, int j, int k) const {
    const int y = j >> 1;
    const int z = k >> 1;
    const int dy = (j & 1) == 0 ? -1 : 1;
    const int dz = (k & 1) == 0 ? -1 : 1;
    const bool in_y = y + dy >= 0 && y + dy < coarse.ny;
    const bool in_z = z + dz >= 0 && z + dz < coarse.nz;
    // Beyond an open side the neighbour is minus this one: 3/4 - 1/4 of it. Beyond the floor it is this one.
    // What is stored of the layer outside is 0.
    const float keep_y = in_y ? 0.75F : 0.5F;
    const float keep_z = in_z ? 0.75F : (dz < 0 ? 1.F : 0.5F);
    const float* near = coarse_q + coarse.index(x, y, z);
    const float* beside = coarse_q + coarse.index(x, y + dy, z);
    const float* over = coarse_q + coarse.index(x, y, z + dz);
    const float* across = coarse_q + coarse.index(x, y + dy, z + dz);
    const auto column = [&](int at) {
      return keep_z * (keep_y * near[at] + 0.25F * beside[at]) +
             0.25F * (keep_y * over[at] + 0.25F * across[at]);
    };
    const float middle = column(0);
    float* to = q + fine.index(2 * x, j, k);
    to[0] += (x > 0 ? 0.75F : 0.5F) * middle + 0.25F * column(-1);
    to[1] += (x + 1 < coarse.nx ? 0.75F : 0.5F) * middle + 0.25F * column(1);
  }
};

struct SetZero {
  float* to = nullptr;
  FluidGrid grid;

  HOST_DEVICE void operator()(int i, int j, int k) const { to[grid.index(i, j, k)] = 0; }
};

// Conjugate gradients, with two sums at a time for each row.

/// out = A d; sums d . out
struct ApplyEquation {
  PressureEquation equation;
  const float* d = nullptr;
  float* out = nullptr;

  HOST_DEVICE FluidSums operator()(std::size_t c) const {
    const float v = equation.apply(d, c);
    out[c] = v;
    return {static_cast<double>(d[c]) * static_cast<double>(v), 0};
  }
};

/// x += alpha d, r -= alpha (A d); sums r . r
struct DescendAlong {
  const float* d = nullptr;
  const float* image = nullptr;  ///< A d
  float* x = nullptr;
  float* r = nullptr;
  float alpha = 0;

  HOST_DEVICE FluidSums operator()(std::size_t c) const {
    x[c] += alpha * d[c];
    const float v = r[c] - alpha * image[c];
    r[c] = v;
    return {static_cast<double>(v) * static_cast<double>(v), 0};
  }
};

/// Sums p . s and q . s
struct TwoProducts {
  const float* p = nullptr;
  const float* q = nullptr;
  const float* s = nullptr;

  HOST_DEVICE FluidSums operator()(std::size_t c) const {
    const auto v = static_cast<double>(s[c]);
    return {static_cast<double>(p[c]) * v, static_cast<double>(q[c]) * v};
  }
};

/// Sums one array
struct SumCells {
  const float* of = nullptr;

  HOST_DEVICE FluidSums operator()(std::size_t c) const { return {static_cast<double>(of[c]), 0}; }
};

/// d = z + beta d
struct NextDirection {
  const float* z = nullptr;
  float* d = nullptr;
  FluidGrid grid;
  float beta = 0;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    d[c] = z[c] + beta * d[c];
  }
};

/// Calls a term for each cell of a row, in order, and keeps the sum: rows(0, j, k).
template <class Term>
struct SumRow {
  Term term;
  FluidGrid grid;
  FluidSums* sums = nullptr;  ///< ny * nz

  HOST_DEVICE void operator()(int, int j, int k) const {
    const std::size_t first = grid.index(0, j, k);
    const auto count = static_cast<std::size_t>(grid.nx);
    FluidSums sum;
    for (std::size_t i = 0; i < count; ++i) sum = sum + term(first + i);
    sums[static_cast<std::size_t>(j) + static_cast<std::size_t>(grid.ny) * static_cast<std::size_t>(k)] = sum;
  }
};

/// The same with the greatest of each lane, and 0.
template <class Term>
struct GreatestOfRow {
  Term term;
  FluidGrid grid;
  FluidSums* sums = nullptr;

  HOST_DEVICE void operator()(int, int j, int k) const {
    const std::size_t first = grid.index(0, j, k);
    const auto count = static_cast<std::size_t>(grid.nx);
    FluidSums most;
    for (std::size_t i = 0; i < count; ++i) most = greater_of(most, term(first + i));
    sums[static_cast<std::size_t>(j) + static_cast<std::size_t>(grid.ny) * static_cast<std::size_t>(k)] =
        most;
  }
};

}  // namespace emberlock::recon
