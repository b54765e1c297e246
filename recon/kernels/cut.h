// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/clip.h"
#include "recon/kernels/lens.h"
#include "recon/kernels/march.h"
#include "recon/kernels/refract.h"

namespace emberlock::recon {

/// Cuts samples [0, count) of a stretch at the slabs' borders: piece(first, size), front to back. `z` is
/// where the line starts and `dz` its direction along z.
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

/// Finds a ray's runs: where it crosses the medium, in equal steps, cut where it enters another slab.
struct CutRay {
  VoxelMask voxels;
  VoxelMask blocks;  ///< as clip_to_medium() takes them
  float step = 1;    ///< the longest, voxel edges
  IndexField gas;    ///< bends the rays where it has values

  /// emit(run, origin, direction) for every run, front to back; ray and first_sample are left to the caller.
  /// Origin and direction are those of the straight line that the run lies on.
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

  /// The runs of a stretch [t0, t1] of a straight line, all of it inside the medium; `before` is what lies
  /// there in front of it, and then with it.
  template <class Emit>
  HOST_DEVICE inline void cut_stretch(const float* origin, const float* direction, float t0, float t1,
                                      float& before, const Emit& emit) const {
    constexpr float kSliver = 1e-4F;  // voxel edges; a corner that is barely touched adds nothing
    if (t1 - t0 < kSliver) return;
    const int steps = static_cast<int>(ceilf((t1 - t0) / step - 1e-3F));
    const int count = steps > 1 ? steps : 1;
    const float ds = (t1 - t0) / static_cast<float>(count);
    cut_at_slabs(origin[2], direction[2], t0, ds, count, voxels.mz, [&](int first, int size) {
      const float ahead = static_cast<float>(first) * ds;
      // The middle sample tells the slab: the first may have been rounded across the border.
      const int middle = first + size / 2;
      const float t = t0 + (static_cast<float>(middle) + 0.5F) * ds;
      const int slab = clamp_cell(origin[2] + direction[2] * t, voxels.mz + 1) / kSlab;
      emit(Run{t0 + ahead, ds, before + ahead, 0, 0, size, slab}, origin, direction);
    });
    before += t1 - t0;
  }

 private:
  /// The runs of a straight line's first `length` edges.
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

struct RayCounts {
  std::uint32_t rays = 0, runs = 0, samples = 0;

  HOST_DEVICE inline friend RayCounts operator+(const RayCounts& a, const RayCounts& b) {
    return {a.rays + b.rays, a.runs + b.runs, a.samples + b.samples};
  }
};

/// Cuts the rays of a list of pixels, in two passes, so that each knows its place: counts, whose sums over
/// those before it are taken in between, and the list itself.
struct CutPixels {
  CutRay cut;
  const PixelRays* cameras = nullptr;  ///< one a view
  const float* origins = nullptr;      ///< 3 a view, in voxel edges
  const PixelOfView* pixels = nullptr;
};
struct CountPixelRuns {
  CutPixels of;
  RayCounts* counts = nullptr;  ///< one a pixel

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
  const RayCounts* before = nullptr;  ///< of the pixels in front, one a pixel
  MarchRay* rays = nullptr;
  Run* runs = nullptr;
  Bend* bends = nullptr;            ///< null where rays are straight
  std::uint32_t* pixels = nullptr;  ///< one a ray

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

}  // namespace emberlock::recon
