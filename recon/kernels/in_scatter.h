// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include <math.h>

#include "base/host_device.h"
#include "recon/kernels/extinction.h"
#include "recon/kernels/march.h"
#include "recon/kernels/phase_function.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

// Light that arrives at coarse key points, by long characteristics: from a key point, against the direction
// of travel, to the face of the grid's box. Coordinates and lengths are in coarse edges.

/// One direction of the discrete ordinates.
struct Ordinate {
  float travel[3] = {0, 0, 1};  ///< direction of the light, unit length
  float weight = 0;             ///< its solid angle, sr; the sum is 4 pi
};

/// The source at the key points of a coarse grid, trilinear between them: lanes 0..2 the source per edge,
/// lane 3 sigma_t per edge.
struct ShiningGrid {
  int nx = 2, ny = 2, nz = 2;
  const Rgba* shine = nullptr;

  /// Inside the voxel whose lowest key point is p; processes four lanes at a time, for CPUs without wider
  /// vectors.
  [[nodiscard]] HOST_DEVICE Rgba inside(const Rgba* p, float fx, float fy, float fz) const {
    const auto row = static_cast<std::size_t>(nx);
    const std::size_t plane = row * static_cast<std::size_t>(ny);
    const Rgba a = p[0] + fx * (p[1] - p[0]);
    const Rgba b = p[row] + fx * (p[row + 1] - p[row]);
    const Rgba c = p[plane] + fx * (p[plane + 1] - p[plane]);
    const Rgba d = p[plane + row] + fx * (p[plane + row + 1] - p[plane + row]);
    const Rgba low = a + fy * (b - a);
    const Rgba high = c + fy * (d - c);
    return low + fz * (high - low);
  }

  [[nodiscard]] HOST_DEVICE Rgba at(float x, float y, float z) const {
    const int i = clamp_cell(x, nx);
    const int j = clamp_cell(y, ny);
    const int k = clamp_cell(z, nz);
    const auto row = static_cast<std::size_t>(nx);
    const std::size_t plane = row * static_cast<std::size_t>(ny);
    const std::size_t base =
        static_cast<std::size_t>(i) + row * static_cast<std::size_t>(j) + plane * static_cast<std::size_t>(k);
    return inside(shine + base, x - static_cast<float>(i), y - static_cast<float>(j),
                  z - static_cast<float>(k));
  }

  /// Distance from p against `travel` to the box's face; 0 if p lies on a face through which the light
  /// enters.
  [[nodiscard]] HOST_DEVICE float way_out(const float* p, const float* travel) const {
    const int last[3] = {nx - 1, ny - 1, nz - 1};
    float length = 1e30F;
    for (int a = 0; a < 3; ++a) {
      if (travel[a] == 0) continue;
      const float room = travel[a] < 0 ? static_cast<float>(last[a]) - p[a] : p[a];
      length = fminf(length, room / fabsf(travel[a]));
    }
    return fmaxf(length, 0);
  }
};

/// L += T S ds phi(sigma ds), T *= exp(-sigma ds), phi(x) = (1 - exp(-x)) / x, outwards from an eye.
struct Radiance {
  Rgba sum;
  float transmittance = 1;

  HOST_DEVICE void add(const Rgba& shine, float ds) {
    const float x = shine.c[3] * ds;
    const float mean = phi(x);
    sum = sum + (transmittance * ds * mean) * shine;
    transmittance *= 1 - x * mean;
  }
  /// Almost nothing gets through, so the march can stop.
  [[nodiscard]] HOST_DEVICE bool opaque() const { return transmittance < 1e-5F; }
  /// Lanes 0..2: the radiance; lane 3: the share of light absorbed on the way, 1 - T.
  [[nodiscard]] HOST_DEVICE Rgba arrived() const {
    Rgba all = sum;
    all.c[3] = 1 - transmittance;
    return all;
  }
};

/// The middle of a step of one edge along an ordinate: its voxel as an index offset from the eye's key point,
/// and the position within the voxel. The same for every eye, because key points have integer coordinates. No
/// ordinate runs along a face, so if a step ends inside the box, the voxel of its middle is inside too.
struct Footstep {
  std::ptrdiff_t voxel = 0;
  float fx = 0, fy = 0, fz = 0;
};

HOST_DEVICE inline Footstep footstep(const ShiningGrid& grid, const float* travel, int step) {
  const float t = static_cast<float>(step) + 0.5F;
  const float x = -t * travel[0];
  const float y = -t * travel[1];
  const float z = -t * travel[2];
  const float i = floorf(x);
  const float j = floorf(y);
  const float k = floorf(z);
  const auto row = static_cast<std::ptrdiff_t>(grid.nx);
  const std::ptrdiff_t plane = row * grid.ny;
  return {static_cast<std::ptrdiff_t>(i) + row * static_cast<std::ptrdiff_t>(j) +
              plane * static_cast<std::ptrdiff_t>(k),
          x - i, y - j, z - k};
}

/// The radiance that arrives at the key point p, of index `eye`, along `travel`: S and sigma are sampled at
/// the middles of steps of one edge and of the remainder up to the face. `footsteps` are those of an
/// ordinate, as many as the length of the grid's diagonal; null for other directions.
struct ArrivingRadiance {
  ShiningGrid grid;
  const Footstep* footsteps = nullptr;

  HOST_DEVICE Rgba operator()(const float* p, std::size_t eye, const float* travel) const {
    constexpr float kTouch = 1e-4F;  // shorter remainders are rounding errors at a face
    const float length = grid.way_out(p, travel);
    const int whole = static_cast<int>(length);
    Radiance radiance;
    for (int i = 0; i < whole; ++i) {
      if (footsteps != nullptr) {
        const Footstep& f = footsteps[i];
        radiance.add(grid.inside(grid.shine + (static_cast<std::ptrdiff_t>(eye) + f.voxel), f.fx, f.fy, f.fz),
                     1);
      } else {
        radiance.add(seen(p, travel, static_cast<float>(i) + 0.5F), 1);
      }
      if (radiance.opaque()) return radiance.arrived();
    }
    const float rest = length - static_cast<float>(whole);
    if (rest > kTouch) radiance.add(seen(p, travel, length - 0.5F * rest), rest);
    return radiance.arrived();
  }

 private:
  [[nodiscard]] HOST_DEVICE Rgba seen(const float* p, const float* travel, float t) const {
    return grid.at(p[0] - t * travel[0], p[1] - t * travel[1], p[2] - t * travel[2]);
  }
};

/// Key point of an index, in coarse edges.
HOST_DEVICE inline void key_point(int nx, int ny, std::size_t at, float* p) {
  const auto row = static_cast<std::size_t>(nx);
  const auto rows = static_cast<std::size_t>(ny);
  p[0] = static_cast<float>(at % row);
  p[1] = static_cast<float>(at / row % rows);
  p[2] = static_cast<float>(at / (row * rows));  // NOLINT(bugprone-integer-division): a whole row or layer
}

/// The radiance that arrives at the n-th active key point along ordinate m.
struct ArriveAt {
  ShiningGrid grid;        ///< of ordinate 0
  std::size_t stride = 0;  ///< ordinate m uses grid.shine + m * stride
  const Ordinate* ordinates = nullptr;
  const Footstep* footsteps = nullptr;  ///< `reach` per ordinate
  std::size_t reach = 0;
  const std::size_t* active = nullptr;

  [[nodiscard]] HOST_DEVICE Rgba operator()(std::size_t n, std::size_t m) const {
    float p[3];
    key_point(grid.nx, grid.ny, active[n], p);
    const ArrivingRadiance arriving{{grid.nx, grid.ny, grid.nz, grid.shine + m * stride},
                                    footsteps + m * reach};
    return arriving(p, active[n], ordinates[m].travel);
  }
};
/// The same for all, [ordinate][active point].
struct Arrive {
  ArriveAt at;
  std::size_t count = 0;  ///< number of active points
  Rgba* radiance = nullptr;

  HOST_DEVICE void operator()(std::size_t i) const { radiance[i] = at(i % count, i / count); }
};

/// The in-scatter integral, Int p L dw', towards one of the ordinates, or for isotropic scattering with one
/// row of equal values: a row of the discrete phase matrix times the radiances.
HOST_DEVICE inline Rgba scattered(const float* row, const Rgba* radiance, std::size_t stride, int ordinates) {
  Rgba sum;
  for (int m = 0; m < ordinates; ++m) sum = sum + row[m] * radiance[static_cast<std::size_t>(m) * stride];
  return sum;
}

/// The same for all, [row][active point].
struct Scatter {
  const float* phase = nullptr;  ///< [row][ordinate]
  int ordinates = 0;
  std::size_t count = 0;  ///< number of active points
  const Rgba* radiance = nullptr;
  Rgba* out = nullptr;

  HOST_DEVICE void operator()(std::size_t i) const {
    out[i] = scattered(phase + i / count * static_cast<std::size_t>(ordinates), radiance + i % count, count,
                       ordinates);
  }
};

/// The same integral towards any direction: the phase function's values at the ordinates, normalised to
/// integrate to 1.
struct ScatteredTowards {
  HenyeyGreenstein<float> phase;
  const Ordinate* ordinates = nullptr;
  int count = 0;

  HOST_DEVICE Rgba operator()(const float* direction, const Rgba* radiance, std::size_t stride) const {
    Rgba sum;
    float norm = 0;
    for (int m = 0; m < count; ++m) {
      const Ordinate& o = ordinates[m];
      const float weight = o.weight * phase(o.travel[0] * direction[0] + o.travel[1] * direction[1] +
                                            o.travel[2] * direction[2]);
      norm += weight;
      sum = sum + weight * radiance[static_cast<std::size_t>(m) * stride];
    }
    return (1 / norm) * sum;
  }
};

/// The direction from a key point to a camera's centre.
struct WayToCamera {
  int nx = 2, ny = 2;
  double center[3] = {0, 0, 0};  ///< in coarse edges

  /// `direction` has unit length; up if the camera is at the point.
  HOST_DEVICE void operator()(std::size_t at, float* point, float* direction) const {
    key_point(nx, ny, at, point);
    double d[3];
    for (int a = 0; a < 3; ++a) d[a] = center[a] - static_cast<double>(point[a]);
    const double norm = sqrt(d[0] * d[0] + (d[1] * d[1] + d[2] * d[2]));
    for (int a = 0; a < 3; ++a)
      direction[a] = norm > 0 ? static_cast<float>(d[a] / norm) : (a == 2 ? 1.F : 0.F);
  }
};

/// The part of anisotropic G that the ordinates resolve, from the n-th active point towards a camera.
struct BluntTowards {
  WayToCamera way;
  ScatteredTowards towards;
  const std::size_t* active = nullptr;
  std::size_t count = 0;           ///< number of active points
  const Rgba* radiance = nullptr;  ///< [ordinate][active point]
  Rgba* out = nullptr;             ///< one per key point

  HOST_DEVICE void operator()(std::size_t n) const {
    float point[3];
    float direction[3];
    way(active[n], point, direction);
    Rgba g = towards(direction, radiance + n, count);
    g.c[3] = 0;
    out[active[n]] = g;
  }
};

/// Adds the peak's light: from straight behind the point, or from the camera's side.
struct MixPeak {
  WayToCamera way;
  ShiningGrid grid;
  const std::size_t* active = nullptr;
  std::size_t count = 0;  ///< number of active points
  float peak = 0;         ///< share of the peak
  bool back = false;
  Rgba* out = nullptr;  ///< one per key point

  HOST_DEVICE void operator()(std::size_t n) const {
    float point[3];
    float direction[3];
    way(active[n], point, direction);
    if (back)
      for (float& d : direction) d = -d;
    Rgba& to = out[active[n]];
    to = (1 - peak) * to + peak * ArrivingRadiance{grid}(point, active[n], direction);
    to.c[3] = 0;
  }
};

}  // namespace emberlock::recon
