// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/kernels/fluid_advect.h"

namespace emberlock::recon {

// What gas carries is transported in flux form: what leaves a cell arrives in the next, so a fire burns the
// fuel that its burner gave. (MacCormack's paths don't conserve: slow gas that is drawn away fast from a
// burner multiplies; a pool fire released four times its fuel's heat.) Faces take van Leer's limited linear
// values (1977), time Heun's two stages (Shu and Osher 1988): of second order and without new extremes.

/// Van Leer's slope: the harmonic mean of both differences, 0 at extremes.
HOST_DEVICE inline float limited_slope(float a, float b) {
  const float product = a * b;
  return product > 0 ? 2 * product / (a + b) : 0.F;
}
HOST_DEVICE inline Rgba limited_slope(const Rgba& a, const Rgba& b) {
  Rgba slope;
#ifdef __CUDACC__
  for (int i = 0; i < 4; ++i) slope.c[i] = limited_slope(a.c[i], b.c[i]);
#else
  const auto product = a.c * b.c;
  const Rgba zero;
  slope.c = product > zero.c ? 2.F * product / (a.c + b.c) : zero.c;
#endif
  return slope;
}

/// What rounding made negative.
HOST_DEVICE inline float at_least_zero(float v) { return v > 0 ? v : 0.F; }
HOST_DEVICE inline Rgba at_least_zero(const Rgba& v) { return non_negative(v); }

/// One stage: out = keep start + (1 - keep) (in + dt change of in), where density * change is the mean over
/// faces of mass flux * (face's value - cell's).
template <class Value>
struct Transport {
  const Value* start = nullptr;
  const Value* in = nullptr;
  Value* out = nullptr;
  const Rgba* gas = nullptr;  ///< whose first lane is the temperature: density is inverse to it
  ConstFaceFields velocity;
  FluidGrid grid;
  Value inlet;                  ///< of the burners, in the floor's faces
  float inlet_temperature = 0;  ///< K
  float cells = 0;              ///< dt / edge
  float keep = 0;

  /// The inflow through the face on one side of the cell (Side -1 or 1) times (face's value - cell's). The
  /// face's density is that of its own temperature, by the same rule as its value: only so does what flows in
  /// without divergence keep the mass that the temperatures tell.
  template <int Axis, int Side>
  [[nodiscard]] HOST_DEVICE Value through(std::size_t c, int at, int last) const {
    const std::size_t step = grid.template stride<Axis>();
    const std::size_t next = Side < 0 ? c - step : c + step;
    const float speed = Side < 0 ? velocity.axis[Axis][c] : -velocity.axis[Axis][next];  // inwards
    const bool boundary = Side < 0 ? at == 0 : at == last;
    const float here = gas[c].c[0];
    if (Axis == 2 && Side < 0 && boundary) return (speed * here / inlet_temperature) * (inlet - in[c]);
    const bool inflow = speed > 0;
    const std::size_t up = inflow ? next : c;
    const std::size_t down = inflow ? c : next;
    const std::size_t beyond = up + (up - down);  // wraps around where it is negative
    const bool floor_beyond = Axis == 2 && (inflow ? Side < 0 && at < 2 : Side > 0 && at == 0);
    const bool linear = !boundary && !floor_beyond;
    const float t = gas[up].c[0];
    const float face = linear ? t + 0.5F * limited_slope(t - gas[beyond].c[0], gas[down].c[0] - t) : t;
    const Value value =
        linear ? in[up] + 0.5F * limited_slope(in[up] - in[beyond], in[down] - in[up]) : in[up];
    return (speed * here / face) * (value - in[c]);
  }
  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    const Value x = through<0, -1>(c, i, grid.nx - 1) + through<0, 1>(c, i, grid.nx - 1);
    const Value y = through<1, -1>(c, j, grid.ny - 1) + through<1, 1>(c, j, grid.ny - 1);
    const Value z = through<2, -1>(c, k, grid.nz - 1) + through<2, 1>(c, k, grid.nz - 1);
    const Value stepped = in[c] + cells * (x + y + z);
    out[c] = at_least_zero(keep * start[c] + (1 - keep) * stepped);
  }
};

}  // namespace emberlock::recon
