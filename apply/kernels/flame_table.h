// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <math.h>

#include "apply/kernels/vec3.h"
#include "recon/kernels/in_scatter.h"
#include "recon/kernels/rays.h"

namespace emberlock::apply {

inline constexpr int kMostFlames = 64;  ///< of a scene

/// A part of a ray, metres; lanes 0..2 the source, grey levels per metre, lane 3 the extinction, 1/m.
struct RayStep {
  float from = 0, to = 0;
  recon::Rgba shine;
};

/// A flame of a scene, as plain pointers (flame.h).
struct FlameTable {
  // What a camera sees: rays and values at key points per voxel edge.
  recon::RayTable rays;
  const recon::Rgba* source = nullptr;
  const std::int32_t* ray_of_pixel = nullptr;  ///< -1: none
  float edge_meters = 1;                       ///< of a voxel, in the world
  // What surfaces see: the coarse grid, per coarse edge.
  recon::ShiningGrid coarse;
  Affine coarse_from_world, world_from_coarse;
  float coarse_meters = 1;  ///< of a coarse edge, in the world
  bool there = false;       ///< otherwise it is empty
  bool absorbs = false;

  [[nodiscard]] HOST_DEVICE inline recon::Rgba coarse_at(const Vec3& p) const {
    return coarse.at(p.x, p.y, p.z);
  }

  /// How much of the light of a part at distance r is taken along rays, and not from parts that are chosen by
  /// their power: a^2 / (r^2 + a^2), with this a, metres: the coarse grid's edge, and 0 at places farther
  /// from its box than two of them, where 1 / r^2 is bounded.
  [[nodiscard]] HOST_DEVICE inline float close_by(const Vec3& place) const {
    if (!there) return 0;
    constexpr float kMargin = 2;
    const Vec3 p = coarse_from_world.place(place);
    const bool near = p.x >= -kMargin && p.y >= -kMargin && p.z >= -kMargin &&
                      p.x <= static_cast<float>(coarse.nx - 1) + kMargin &&
                      p.y <= static_cast<float>(coarse.ny - 1) + kMargin &&
                      p.z <= static_cast<float>(coarse.nz - 1) + kMargin;
    return near ? coarse_meters : 0;
  }

  /// The part of a line (coarse edges) inside of the coarse box, not before its beginning.
  HOST_DEVICE inline bool inside(const Vec3& from, const Vec3& along, float& enters, float& leaves) const {
    const float p[3] = {from.x, from.y, from.z};
    const float d[3] = {along.x, along.y, along.z};
    const int last[3] = {coarse.nx - 1, coarse.ny - 1, coarse.nz - 1};
    for (int a = 0; a < 3; ++a) {
      const auto end = static_cast<float>(last[a]);
      if (d[a] == 0) {
        if (p[a] < 0 || p[a] > end) return false;
        continue;
      }
      const float low = -p[a] / d[a];
      const float high = (end - p[a]) / d[a];
      enters = fmaxf(enters, fminf(low, high));
      leaves = fminf(leaves, fmaxf(low, high));
    }
    return leaves > enters;
  }

  /// The optical depth of a ray as far as `distance`.
  [[nodiscard]] HOST_DEVICE inline float depth(const Vec3& origin, const Vec3& direction,
                                               float distance) const {
    if (!there || !absorbs) return 0;
    const Vec3 from = coarse_from_world.place(origin);
    const Vec3 along = coarse_from_world.direction(direction);  // of a metre
    float enters = 0;
    float leaves = distance;
    if (!inside(from, along, enters, leaves)) return 0;
    const float edges = (leaves - enters) / coarse_meters;
    const int steps = edges > 1 ? static_cast<int>(ceilf(edges)) : 1;
    const float step = (leaves - enters) / static_cast<float>(steps);
    float sum = 0;
    for (int i = 0; i < steps; ++i)
      sum += coarse_at(from + (enters + (static_cast<float>(i) + 0.5F) * step) * along).c[3];
    return sum * edges / static_cast<float>(steps);
  }

  /// A place in a voxel of the coarse grid (within: 0..1 along each edge), and what it sends out: the source
  /// there times the voxel's volume, grey levels m2.
  HOST_DEVICE inline void sent(std::uint32_t voxel, const Vec3& within, Vec3& place, Vec3& power) const {
    const auto nx = static_cast<std::uint32_t>(coarse.nx);
    const auto ny = static_cast<std::uint32_t>(coarse.ny);
    const std::uint32_t layer = voxel / nx / ny;
    const Vec3 corner = {static_cast<float>(voxel % nx), static_cast<float>(voxel / nx % ny),
                         static_cast<float>(layer)};
    const recon::Rgba shine = coarse.inside(coarse.shine + voxel, within.x, within.y, within.z);
    place = world_from_coarse.place(corner + within);
    power = (coarse_meters * coarse_meters) * Vec3{shine.c[0], shine.c[1], shine.c[2]};
  }
};

/// Which ray goes through each pixel: none, and then those that there are.
struct NoRay {
  std::int32_t* ray_of_pixel;
  HOST_DEVICE inline void operator()(std::size_t pixel) const { ray_of_pixel[pixel] = -1; }
};
struct NumberRay {
  const std::uint32_t* pixels;  ///< of each ray
  std::int32_t* ray_of_pixel;
  HOST_DEVICE inline void operator()(std::size_t ray) const {
    ray_of_pixel[pixels[ray]] = static_cast<std::int32_t>(ray);
  }
};

/// A flame's steps along a camera's ray, by its runs (recon/kernels/rays.h).
struct FineSteps {
  const FlameTable* flame;
  std::uint32_t run, end;
  int sample;
  float reached;

  HOST_DEVICE inline static FineSteps of(const FlameTable& flame, std::size_t pixel) {
    const std::int32_t ray = flame.ray_of_pixel[pixel];
    if (ray < 0) return {&flame, 0, 0, 0, 0};
    const recon::MarchRay& r = flame.rays.rays[ray];
    return {&flame, r.first_run, r.first_run + r.runs, 0, 0};
  }
  HOST_DEVICE inline bool next(RayStep& step) {
    if (run == end) return false;
    const recon::RayTable& table = flame->rays;
    const recon::Run& r = table.runs[run];
    const float meters = flame->edge_meters;
    step.from = sample == 0 ? r.start * meters : reached;
    step.to = (r.start + static_cast<float>(sample + 1) * r.step) * meters;
    const auto line = recon::StraightPath::line<float>(table, run);
    const float t = r.start + (static_cast<float>(sample) + 0.5F) * r.step;
    const float x = line.origin[0] + line.direction[0] * t;
    const float y = line.origin[1] + line.direction[1] * t;
    const float z = line.origin[2] + line.direction[2] * t;
    // As locate(): a sample that rounding puts across its slab's border is taken as in the slab.
    const int low = r.slab * recon::kSlab;
    const int high = low + recon::kSlab < table.nz - 1 ? low + recon::kSlab - 1 : table.nz - 2;
    const int ix = recon::clamp_cell(x, table.nx);
    const int iy = recon::clamp_cell(y, table.ny);
    const int iz = recon::clamp_to(static_cast<int>(z), low, high);
    const auto row = static_cast<std::size_t>(table.nx);
    const std::size_t plane = row * static_cast<std::size_t>(table.ny);
    const std::size_t base = static_cast<std::size_t>(ix) + row * static_cast<std::size_t>(iy) +
                             plane * static_cast<std::size_t>(iz);
    step.shine = (1 / meters) * recon::trilinear(flame->source + base, row, plane, x - static_cast<float>(ix),
                                                 y - static_cast<float>(iy), z - static_cast<float>(iz));
    reached = step.to;
    if (++sample == r.count) {
      ++run;
      sample = 0;
    }
    return true;
  }
};

/// A flame's steps along any ray, by its coarse grid; of its light the share that close_by() says, of this a;
/// of its extinction all.
struct CoarseSteps {  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
  const FlameTable* flame;
  Vec3 from, along;  // coarse edges; of a metre
  float enters, step, a;
  int sample, steps;

  HOST_DEVICE inline static CoarseSteps of(const FlameTable& flame, const Vec3& origin, const Vec3& direction,
                                           float a) {
    CoarseSteps all{&flame,
                    flame.coarse_from_world.place(origin),
                    flame.coarse_from_world.direction(direction),
                    0,
                    0,
                    a,
                    0,
                    0};
    float leaves = 3e38F;
    if (!flame.there || !flame.inside(all.from, all.along, all.enters, leaves)) return all;
    const float edges = (leaves - all.enters) / flame.coarse_meters;
    all.steps = edges > 1 ? static_cast<int>(ceilf(edges)) : 1;
    all.step = (leaves - all.enters) / static_cast<float>(all.steps);
    return all;
  }
  HOST_DEVICE inline bool next(RayStep& to) {
    if (sample == steps) return false;
    const float t = enters + (static_cast<float>(sample) + 0.5F) * step;
    to.from = enters + static_cast<float>(sample) * step;
    to.to = enters + static_cast<float>(sample + 1) * step;
    to.shine = (1 / flame->coarse_meters) * flame->coarse_at(from + t * along);
    const float share = a > 0 ? a * a / (t * t + a * a) : 0;
    for (int c = 0; c < 3; ++c) to.shine.c[c] *= share;
    ++sample;
    return true;
  }
};

}  // namespace emberlock::apply
