#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/rgba.h"

namespace emberlock {

// One source for the march, on the CPU and on the GPU. Coordinates count voxel edges from key point (0, 0,
// 0).

/// A stretch inside the medium, cut into equal steps; sample i lies at start + (i + 0.5) * step along the
/// ray.
struct Run {
  float start = 0;
  float step = 0;
  float before = 0;  ///< length inside the medium in front of this run
  int count = 0;
  std::uint32_t first_sample = 0;  ///< samples on the ray in front of this run
};

struct MarchRay {
  float direction[3] = {0, 0, 1};  ///< unit length
  std::uint32_t view = 0;
  std::uint32_t first_run = 0;
  std::uint32_t runs = 0;
};

/// Rays and the key points that they march through; plain pointers, so that it lives on either side.
struct RayTable {
  const float* origins = nullptr;  ///< 3 a view
  const MarchRay* rays = nullptr;
  const Run* runs = nullptr;
  int nx = 2, ny = 2, nz = 2;  ///< key points
};

/// No extinction: nothing of the transmittance is ever computed.
struct NoExtinction {
  [[nodiscard]] HOST_DEVICE float at(float /*length*/) const { return 1; }
  [[nodiscard]] HOST_DEVICE float over(float /*step*/) const { return 1; }
  [[nodiscard]] HOST_DEVICE float weight(float step) const { return step; }
};

/// Constant extinction inside the medium, `sigma` a voxel edge.
struct ConstantExtinction {
  float sigma = 0;
  [[nodiscard]] HOST_DEVICE float at(float length) const { return expf(-sigma * length); }
  [[nodiscard]] HOST_DEVICE float over(float step) const { return expf(-sigma * step); }
  /// ds * phi(sigma ds), phi(x) = (1 - exp(-x)) / x
  [[nodiscard]] HOST_DEVICE float weight(float step) const {
    const float x = sigma * step;
    return x > 1e-6F ? -expm1f(-x) / sigma : step * (1 - 0.5F * x);
  }
};

/// The voxel of a sample: index of its lowest key point and the position inside.
struct Cell {
  std::size_t base;
  float fx, fy, fz;
};

HOST_DEVICE inline int clamp_cell(float p, int key_points) {
  const int i = static_cast<int>(p);
  return i < 0 ? 0 : (i > key_points - 2 ? key_points - 2 : i);
}

/// A ray's samples as the march meets them.
struct Marcher {
  const RayTable& table;
  const MarchRay& ray;
  const float* origin;

  HOST_DEVICE Marcher(const RayTable& t, std::size_t index)
      : table(t), ray(t.rays[index]), origin(t.origins + 3 * static_cast<std::size_t>(t.rays[index].view)) {}

  [[nodiscard]] HOST_DEVICE static float distance(const Run& run, int i) {
    return run.start + (static_cast<float>(i) + 0.5F) * run.step;
  }
  [[nodiscard]] HOST_DEVICE int layer(const Run& run, int i) const {
    return clamp_cell(origin[2] + ray.direction[2] * distance(run, i), table.nz);
  }
  [[nodiscard]] HOST_DEVICE Cell cell(const Run& run, int i) const {
    const float t = distance(run, i);
    const float x = origin[0] + ray.direction[0] * t;
    const float y = origin[1] + ray.direction[1] * t;
    const float z = origin[2] + ray.direction[2] * t;
    const int ix = clamp_cell(x, table.nx);
    const int iy = clamp_cell(y, table.ny);
    const int iz = clamp_cell(z, table.nz);
    const auto base = static_cast<std::size_t>(ix) +
                      static_cast<std::size_t>(table.nx) *
                          (static_cast<std::size_t>(iy) +
                           static_cast<std::size_t>(table.ny) * static_cast<std::size_t>(iz));
    return {base, x - static_cast<float>(ix), y - static_cast<float>(iy), z - static_cast<float>(iz)};
  }

  /// The first sample of the run whose layer is on the far side of `bound`, count if none: layer >= bound on
  /// a rising ray, layer < bound on a falling one. The estimate is mended by the samples' own arithmetic, so
  /// that neighbouring slabs share no sample and miss none.
  [[nodiscard]] HOST_DEVICE int first_beyond(const Run& run, int bound) const {
    const bool rising = ray.direction[2] >= 0;
    const float z0 = origin[2] + ray.direction[2] * distance(run, 0);
    const float guess = (static_cast<float>(bound) - z0) / (ray.direction[2] * run.step);
    int i = guess > 0 ? (guess < static_cast<float>(run.count) ? static_cast<int>(guess) : run.count) : 0;
    while (i < run.count && (layer(run, i) >= bound) != rising) ++i;
    while (i > 0 && (layer(run, i - 1) >= bound) == rising) --i;
    return i;
  }
};

HOST_DEVICE inline Rgba trilinear(const Rgba* v, const Cell& c, int nx, int ny) {
  const std::size_t row = static_cast<std::size_t>(nx);
  const std::size_t plane = row * static_cast<std::size_t>(ny);
  const Rgba* p = v + c.base;
  const Rgba a = p[0] + c.fx * (p[1] - p[0]);
  const Rgba b = p[row] + c.fx * (p[row + 1] - p[row]);
  const Rgba d = p[plane] + c.fx * (p[plane + 1] - p[plane]);
  const Rgba e = p[plane + row] + c.fx * (p[plane + row + 1] - p[plane + row]);
  const Rgba low = a + c.fy * (b - a);
  const Rgba high = d + c.fy * (e - d);
  return low + c.fz * (high - low);
}

/// L of one ray: L += T S ds phi(sigma ds), T *= exp(-sigma ds). Lengths in voxel edges, so S is per voxel
/// edge here.
template <class Extinction>
struct Forward {
  RayTable table;
  const Rgba* volume = nullptr;
  Extinction extinction;

  HOST_DEVICE Rgba operator()(std::size_t index) const {
    const Marcher march(table, index);
    Rgba radiance;
    for (std::uint32_t r = 0; r < march.ray.runs; ++r) {
      const Run run = table.runs[march.ray.first_run + r];
      const float pass = extinction.over(run.step);
      float weight = extinction.at(run.before) * extinction.weight(run.step);
      for (int i = 0; i < run.count; ++i) {
        radiance = radiance + weight * trilinear(volume, march.cell(run, i), table.nx, table.ny);
        weight *= pass;
      }
    }
    return radiance;
  }
};

/// Visits the samples of a ray whose voxels lie in layers [low, high) along z, front to back: visit(cell,
/// transmittance in front of the sample, its weight ds phi(sigma ds), the number of the sample on its ray).
template <class Extinction, class Visit>
HOST_DEVICE void visit_layers(const RayTable& table, std::size_t index, const Extinction& extinction, int low,
                              int high, const Visit& visit) {
  const Marcher march(table, index);
  const bool rising = march.ray.direction[2] >= 0;
  for (std::uint32_t r = 0; r < march.ray.runs; ++r) {
    const Run run = table.runs[march.ray.first_run + r];
    const int begin = march.first_beyond(run, rising ? low : high);
    const int end = march.first_beyond(run, rising ? high : low);
    if (begin >= end) continue;
    const float pass = extinction.over(run.step);
    const float weight = extinction.weight(run.step);
    float transmittance = extinction.at(run.before + static_cast<float>(begin) * run.step);
    for (int i = begin; i < end; ++i) {
      visit(march.cell(run, i), transmittance, weight, run.first_sample + static_cast<std::uint32_t>(i));
      transmittance *= pass;
    }
  }
}

/// Plain addition, for callers that own the key points they write to.
struct AddDirectly {
  HOST_DEVICE void operator()(Rgba& target, const Rgba& value) const { target = target + value; }
};

/// The exact transpose of Forward, restricted to layers [low, high): adds the ray's residual to the 8 key
/// points of each sample with the weights that Forward reads them with.
template <class Extinction, class Add = AddDirectly>
struct Adjoint {
  RayTable table;
  const Rgba* residual = nullptr;  ///< one a ray
  Rgba* gradient = nullptr;
  Extinction extinction;
  Add add = {};

  HOST_DEVICE void operator()(std::size_t index, int low, int high) const {
    const std::size_t row = static_cast<std::size_t>(table.nx);
    const std::size_t plane = row * static_cast<std::size_t>(table.ny);
    const Rgba r = residual[index];
    visit_layers(table, index, extinction, low, high,
                 [&](const Cell& c, float transmittance, float weight, std::uint32_t) {
                   const Rgba w = (transmittance * weight) * r;
                   Rgba* p = gradient + c.base;
                   const Rgba x1 = c.fx * w;
                   const Rgba x0 = w - x1;
                   const Rgba x0y1 = c.fy * x0;
                   const Rgba x0y0 = x0 - x0y1;
                   const Rgba x1y1 = c.fy * x1;
                   const Rgba x1y0 = x1 - x1y1;
                   add(p[0], (1 - c.fz) * x0y0);
                   add(p[1], (1 - c.fz) * x1y0);
                   add(p[row], (1 - c.fz) * x0y1);
                   add(p[row + 1], (1 - c.fz) * x1y1);
                   add(p[plane], c.fz * x0y0);
                   add(p[plane + 1], c.fz * x1y0);
                   add(p[plane + row], c.fz * x0y1);
                   add(p[plane + row + 1], c.fz * x1y1);
                 });
  }
};

}  // namespace emberlock
