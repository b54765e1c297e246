// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "apply/kernels/flame_table.h"
#include "recon/kernels/extinction.h"

namespace emberlock::apply {

/// Radiance in lanes 0..2, transmittance in lane 3: nothing yet.
HOST_DEVICE inline recon::Rgba clear_view() { return recon::Rgba{{0, 0, 0, 1}}; }

/// The light behind a stretch of constant values, from that before it: as in the march
/// (recon/render/render.h), L += T S ds phi(sigma ds), T *= exp(-sigma ds).
HOST_DEVICE inline recon::Rgba light_behind(const recon::Rgba& before, const recon::Rgba& shine,
                                            float length) {
  const float depth = shine.c[3] * length;
  const float mean = recon::phi(depth);
  recon::Rgba after = before + (before.c[3] * length * mean) * shine;
  after.c[3] = before.c[3] * (1 - depth * mean);
  return after;
}

/// What flames do to the light along one ray, several of them merged by distance: each is a row of steps with
/// constant values, from near to far without overlaps; where those of several flames overlap, their emission
/// and their extinction add up. `Steps` has next(RayStep&), which says whether there was another one.
template <class Steps, int kMost>
struct MergedLight {  // NOLINT(cppcoreguidelines-pro-type-member-init): filled before it is read
  Steps steps[kMost];
  RayStep now[kMost];
  int count = 0;

  HOST_DEVICE inline void add(const Steps& flame) {
    steps[count] = flame;
    if (steps[count].next(now[count])) ++count;
  }

  /// The light that comes from nearer than each of some distances, which ascend; consumes the steps.
  HOST_DEVICE inline void up_to(const float* distances, int wanted, recon::Rgba* light) {
    recon::Rgba reached = clear_view();
    int done = 0;
    float here = -3e38F;
    while (done < wanted) {
      float until = 3e38F;
      recon::Rgba shine;
      bool inside = false;
      for (int f = 0; f < count; ++f) {
        if (now[f].from <= here) {
          shine = shine + now[f].shine;
          inside = true;
        }
        until = fminf(until, now[f].from <= here ? now[f].to : now[f].from);
      }
      if (count == 0) until = 3.4e38F;
      while (done < wanted && distances[done] <= until) {
        const float part = distances[done] - here;
        light[done++] = inside && part > 0 ? light_behind(reached, shine, part) : reached;
      }
      if (count == 0) break;
      if (inside) reached = light_behind(reached, shine, until - here);
      here = until;
      for (int f = 0; f < count;) {
        if (now[f].to > here || steps[f].next(now[f])) {
          ++f;
          continue;
        }
        --count;
        steps[f] = steps[count];
        now[f] = now[count];
      }
    }
  }
};

}  // namespace emberlock::apply
