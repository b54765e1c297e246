// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "recon/kernels/rgba.h"

namespace emberlock::apply {

/// What flames do to the light along one ray, several of them merged by distance: each is a row of steps with
/// constant values, and where they overlap their emission and their extinction add up. Within a step light
/// goes as in the march (recon/render/render.h): L += T S ds phi(sigma ds), T *= exp(-sigma ds).
class RayLight {
 public:
  /// A part of the ray, in metres; lanes 0..2 the source, grey levels per metre, lane 3 the extinction, 1/m.
  struct Step {
    float from, to;
    recon::Rgba shine;
  };

  void clear();
  /// Where the next flame puts its steps, from near to far without overlaps; ended by end_flame().
  std::vector<Step>& steps() { return steps_; }
  void end_flame();
  /// After the last flame.
  void merge();

  /// Radiance of what lies nearer than `distance` metres, grey levels; lane 3: its transmittance.
  [[nodiscard]] recon::Rgba up_to(float distance) const;
  /// Of all of it.
  [[nodiscard]] recon::Rgba all() const { return stretches_.empty() ? nothing() : stretches_.back().after; }

 private:
  struct Stretch {
    float from, to;
    recon::Rgba shine, after;  // after: as up_to(to)
  };
  static recon::Rgba nothing() { return recon::Rgba{{0, 0, 0, 1}}; }
  void append(float from, float to, const recon::Rgba& shine);

  std::vector<Step> steps_;
  std::vector<std::size_t> ends_;  // of each flame's steps
  std::vector<std::size_t> next_;  // of each flame, while they are merged
  std::vector<Stretch> stretches_;
};

}  // namespace emberlock::apply
