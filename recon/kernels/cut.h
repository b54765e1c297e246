// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/clip.h"
#include "recon/kernels/lens.h"
#include "recon/kernels/march.h"
#include "recon/kernels/pixel_rule.h"
#include "recon/kernels/refract.h"

namespace emberlock::recon {

/// Divides samples [0, count) of an interval at the slabs' borders: calls piece(first, size), front to back.
/// `z` is the start of the line and `dz` its direction along z.
template <class Piece>
HOST_DEVICE inline void cut_at_slabs(float z, float dz, float start, float step, int count, int layers,
                                     const Piece& piece) {
  const auto slab_of = [&](int i) {
    const float at = z + dz * (start + (static_cast<float>(i) + 0.5F) * step);
    return clamp_to(static_cast<int>(at), 0, layers - 1) / kSlab;
  };
  int first = 0;
  while (first < count) {
    const int slab = slab_of(first);
    int end = count;
    if (slab_of(count - 1) != slab) {
      const float border = static_cast<float>((dz > 0 ? slab + 1 : slab) * kSlab);
      const float guess = ((border - z) / dz - start) / step;
      end = clamp_to(static_cast<int>(guess), first + 1, count);
      while (end > first + 1 && slab_of(end - 1) != slab) --end;
      while (end < count && slab_of(end) == slab) ++end;
    }
    piece(first, end - first);
    first = end;
  }
}

/// Finds a ray's runs: its intervals inside the medium, in equal steps, divided at slab borders.
struct CutRay {
  VoxelMask voxels;
  VoxelMask blocks;  ///< as for clip_to_medium()
  float step = 1;    ///< maximum, voxel edges
  IndexField gas;    ///< bends the rays if it has values

  /// Calls emit(run, origin, direction) for every run, front to back; the caller sets ray and first_sample.
  /// Origin and direction are those of the straight line that contains the run.
  template <class Emit>
  HOST_DEVICE inline void operator()(const float* origin, const float* direction, const Emit& emit) const {
    float before = 0;
    if (gas.values == nullptr) {
      cut_line(origin, direction, kEndless, before, emit);
      return;
    }
    trace(gas, origin, direction, [&](const float* from, const float* along, float length) {
      cut_line(from, along, length, before, emit);
    });
  }

  /// The runs of an interval [t0, t1] of a straight line, which lies inside the medium; `before` is the
  /// length of the medium in front of it, and is increased by it.
  template <class Emit>
  HOST_DEVICE inline void cut_stretch(const float* origin, const float* direction, float t0, float t1,
                                      float& before, const Emit& emit) const {
    constexpr float kSliver = 1e-4F;  // voxel edges; a touched corner contributes nothing
    if (t1 - t0 < kSliver) return;
    const int steps = static_cast<int>(ceilf((t1 - t0) / step - 1e-3F));
    const int count = steps > 1 ? steps : 1;
    const float ds = (t1 - t0) / static_cast<float>(count);
    cut_at_slabs(origin[2], direction[2], t0, ds, count, voxels.mz, [&](int first, int size) {
      const float ahead = static_cast<float>(first) * ds;
      // The middle sample determines the slab, because rounding may put the first one across the border.
      const int middle = first + size / 2;
      const float t = t0 + (static_cast<float>(middle) + 0.5F) * ds;
      const int slab = clamp_cell(origin[2] + direction[2] * t, voxels.mz + 1) / kSlab;
      emit(Run{t0 + ahead, ds, before + ahead, 0, 0, size, slab}, origin, direction);
    });
    before += t1 - t0;
  }

 private:
  /// The runs of the first `length` edges of a straight line.
  template <class Emit>
  HOST_DEVICE inline void cut_line(const float* origin, const float* direction, float length, float& before,
                                   const Emit& emit) const {
    clip_to_medium(voxels, blocks, origin, direction, [&](float t0, float t1) {
      cut_stretch(origin, direction, t0, length < t1 ? length : t1, before, emit);
    });
  }
};

/// A pixel that may have a ray.
struct PixelOfView {
  std::uint32_t view = 0;
  std::uint32_t pixel = 0;  ///< y * width + x
};

/// Neighbouring rays read the same key points: a list takes pixels by tiles of kTile * kTile, so that their
/// data stay in the L1 cache.
inline constexpr int kTile = 16;

/// The part of a view's picture, [x0, x1) x [y0, y1), that may have rays, and the first of its slots: a tile
/// has one for each of its pixels, row by row, beyond the part's borders too.
struct TiledView {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  int width = 0;  ///< of the picture
  std::uint32_t first_slot = 0;

  [[nodiscard]] HOST_DEVICE inline int tiles_across() const { return (x1 - x0 + kTile - 1) / kTile; }
  [[nodiscard]] HOST_DEVICE inline int tiles_down() const { return (y1 - y0 + kTile - 1) / kTile; }
};
/// The slots of several views.
struct PixelSlots {
  const TiledView* views = nullptr;
  std::uint32_t count = 0;  ///< views
  PixelRule rule;

  /// Calls act(view, x, y) unless the slot lies beyond the borders.
  template <class Act>
  HOST_DEVICE inline void at(std::uint32_t slot, const Act& act) const {
    std::uint32_t view = 0;
    while (view + 1 < count && views[view + 1].first_slot <= slot) ++view;
    const TiledView& part = views[view];
    const auto in = static_cast<int>(slot - part.first_slot);
    const int tile = in / (kTile * kTile);
    const int x = part.x0 + tile % part.tiles_across() * kTile + in % kTile;
    const int y = part.y0 + tile / part.tiles_across() * kTile + in / kTile % kTile;
    if (x < part.x1 && y < part.y1) act(view, x, y);
  }
};
/// The subset of each slot; `subsets` of those that are in none.
struct NameSubsets {
  PixelSlots slots;
  std::uint8_t subsets = 1;
  std::uint8_t* to = nullptr;

  HOST_DEVICE inline void operator()(std::size_t slot) const {
    int subset = -1;
    slots.at(static_cast<std::uint32_t>(slot),
             [&](std::uint32_t view, int x, int y) { subset = slots.rule(view, x, y); });
    to[slot] = subset < 0 ? subsets : static_cast<std::uint8_t>(subset);
  }
};
/// The pixels of sorted slots.
struct PlacePixels {
  PixelSlots slots;
  const std::uint32_t* sorted = nullptr;
  PixelOfView* to = nullptr;

  HOST_DEVICE inline void operator()(std::size_t n) const {
    slots.at(sorted[n], [&](std::uint32_t view, int x, int y) {
      to[n] = {view, static_cast<std::uint32_t>(y * slots.views[view].width + x)};
    });
  }
};

struct RayCounts {
  std::uint32_t rays = 0, runs = 0, samples = 0;

  HOST_DEVICE inline friend RayCounts operator+(const RayCounts& a, const RayCounts& b) {
    return {a.rays + b.rays, a.runs + b.runs, a.samples + b.samples};
  }
};

/// What comes before the first pixel of each subset.
struct PickCounts {
  const RayCounts* before = nullptr;     ///< of each pixel
  const std::uint32_t* first = nullptr;  ///< of each subset
  RayCounts* to = nullptr;

  HOST_DEVICE inline void operator()(std::size_t subset) const { to[subset] = before[first[subset]]; }
};

/// Computes the rays of a list of pixels in two passes, so that each knows its place in the list: first
/// counts, which are then summed over the preceding pixels, then the list itself.
struct CutPixels {
  CutRay cut;
  const PixelRays* cameras = nullptr;  ///< one per view
  const float* origins = nullptr;      ///< 3 per view, in voxel edges
  const PixelOfView* pixels = nullptr;
};
struct CountPixelRuns {
  CutPixels of;
  RayCounts* counts = nullptr;  ///< one per pixel

  HOST_DEVICE inline void operator()(std::size_t n) const {
    const PixelOfView at = of.pixels[n];
    float direction[3];
    of.cameras[at.view](at.pixel, direction);
    RayCounts found;
    of.cut(of.origins + 3 * static_cast<std::size_t>(at.view), direction,
           [&](const Run& run, const float*, const float*) {
             found = found + RayCounts{0, 1, static_cast<std::uint32_t>(run.count)};
           });
    found.rays = found.runs > 0 ? 1 : 0;
    counts[n] = found;
  }
};
struct WritePixelRuns {
  CutPixels of;
  const RayCounts* before = nullptr;  ///< of the preceding pixels, one per pixel
  MarchRay* rays = nullptr;
  Run* runs = nullptr;
  Bend* bends = nullptr;            ///< null for straight rays
  std::uint32_t* pixels = nullptr;  ///< one per ray

  HOST_DEVICE inline void operator()(std::size_t n) const {
    const PixelOfView at = of.pixels[n];
    MarchRay ray;
    of.cameras[at.view](at.pixel, ray.direction);
    ray.view = at.view;
    RayCounts next = before[n];
    ray.first_run = next.runs;
    of.cut(of.origins + 3 * static_cast<std::size_t>(at.view), ray.direction,
           [&](Run run, const float* from, const float* along) {
             run.ray = next.rays;
             run.first_sample = next.samples;
             if (bends != nullptr)
               bends[next.runs] = {{from[0], from[1], from[2]}, {along[0], along[1], along[2]}};
             runs[next.runs] = run;
             next = next + RayCounts{0, 1, static_cast<std::uint32_t>(run.count)};
           });
    ray.runs = next.runs - ray.first_run;
    if (ray.runs == 0) return;
    rays[next.rays] = ray;
    pixels[next.rays] = at.pixel;
  }
};

/// Adds up the lengths of one chunk of runs, voxel edges.
struct SumLengths {
  static constexpr std::size_t kRuns = 1024;
  const Run* runs = nullptr;
  std::size_t count = 0;
  double* sums = nullptr;  ///< one a chunk

  HOST_DEVICE inline void operator()(std::size_t chunk) const {
    double sum = 0;
    for (std::size_t n = chunk * kRuns; n < count && n < (chunk + 1) * kRuns; ++n)
      sum += static_cast<double>(runs[n].step) * runs[n].count;
    sums[chunk] = sum;
  }
};

}  // namespace emberlock::recon
