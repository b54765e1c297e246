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
/// faces of mass flux * (face's value - cell's). Of the gas and, if there are any, its particles.
struct Transport {
  const Rgba* start = nullptr;  ///< its first lane is the temperature: density is inverse to it
  const Rgba* in = nullptr;
  Rgba* out = nullptr;
  const float* particles_start = nullptr;  ///< or absent
  const float* particles_in = nullptr;
  float* particles_out = nullptr;
  ConstFaceFields velocity;
  FluidGrid grid;
  Rgba inlet;       ///< of the burners, in the floor's faces; no particles
  float cells = 0;  ///< dt / edge
  float keep = 0;

  struct Change {
    Rgba gas;
    float particles = 0;
  };
  template <class Value>
  [[nodiscard]] HOST_DEVICE static Value at_face(const Value* of, std::size_t beyond, std::size_t up,
                                                 std::size_t down) {
    return of[up] + 0.5F * limited_slope(of[up] - of[beyond], of[down] - of[up]);
  }
  /// Adds the inflow through the face on one side of the cell (Side -1 or 1) times (face's value - cell's).
  /// The face's density is that of its own temperature, by the same rule as its value: only so does what
  /// flows in without divergence keep the mass that the temperatures tell.
  template <int Axis, int Side>
  HOST_DEVICE void through(std::size_t c, int at, int last, Change& change) const {
    const std::size_t step = grid.template stride<Axis>();
    const std::size_t next = Side < 0 ? c - step : c + step;
    const float speed = Side < 0 ? velocity.axis[Axis][c] : -velocity.axis[Axis][next];  // inwards
    const bool boundary = Side < 0 ? at == 0 : at == last;
    const bool burner = Axis == 2 && Side < 0 && boundary;
    const bool inflow = speed > 0;
    const std::size_t up = inflow ? next : c;
    const std::size_t down = inflow ? c : next;
    const std::size_t beyond = up + (up - down);  // wraps around where it is negative
    const bool floor_beyond = Axis == 2 && (inflow ? Side < 0 && at < 2 : Side > 0 && at == 0);
    const bool linear = !boundary && !floor_beyond;
    const Rgba value = burner ? inlet : linear ? at_face(in, beyond, up, down) : in[up];
    const float weight = speed * in[c].c[0] / value.c[0];
    change.gas = change.gas + weight * (value - in[c]);
    if (particles_in == nullptr) return;
    const float carried = burner ? 0.F : linear ? at_face(particles_in, beyond, up, down) : particles_in[up];
    change.particles += weight * (carried - particles_in[c]);
  }
  HOST_DEVICE void operator()(int i, int j, int k) const {
    const std::size_t c = grid.index(i, j, k);
    Change change;
    through<0, -1>(c, i, grid.nx - 1, change);
    through<0, 1>(c, i, grid.nx - 1, change);
    through<1, -1>(c, j, grid.ny - 1, change);
    through<1, 1>(c, j, grid.ny - 1, change);
    through<2, -1>(c, k, grid.nz - 1, change);
    through<2, 1>(c, k, grid.nz - 1, change);
    out[c] = at_least_zero(keep * start[c] + (1 - keep) * (in[c] + cells * change.gas));
    if (particles_in == nullptr) return;
    const float stepped = particles_in[c] + cells * change.particles;
    particles_out[c] = at_least_zero(keep * particles_start[c] + (1 - keep) * stepped);
  }
};

}  // namespace emberlock::recon
