// SPDX-License-Identifier: Apache-2.0
#include "apply/ray_light.h"

#include <algorithm>
#include <limits>

#include "recon/kernels/extinction.h"

namespace emberlock::apply {
namespace {

/// The light behind a stretch of constant values, from that before it.
recon::Rgba behind(const recon::Rgba& before, const recon::Rgba& shine, float length) {
  const float depth = shine.c[3] * length;
  const float mean = recon::phi(depth);
  recon::Rgba after = before + (before.c[3] * length * mean) * shine;
  after.c[3] = before.c[3] * (1 - depth * mean);
  return after;
}

}  // namespace

void RayLight::clear() {
  steps_.clear();
  ends_.clear();
  stretches_.clear();
}

void RayLight::end_flame() {
  if (steps_.size() > (ends_.empty() ? 0 : ends_.back())) ends_.push_back(steps_.size());
}

void RayLight::append(float from, float to, const recon::Rgba& shine) {
  stretches_.push_back({from, to, shine, behind(all(), shine, to - from)});
}

void RayLight::merge() {
  stretches_.clear();
  if (ends_.size() == 1) {
    for (const Step& s : steps_) append(s.from, s.to, s.shine);
    return;
  }
  next_.assign(1, 0);
  for (std::size_t f = 0; f + 1 < ends_.size(); ++f) next_.push_back(ends_[f]);
  constexpr float kNever = std::numeric_limits<float>::infinity();
  float here = -kNever;
  for (;;) {
    float until = kNever;
    recon::Rgba shine;
    bool inside = false;
    for (std::size_t f = 0; f < ends_.size(); ++f) {
      while (next_[f] < ends_[f] && steps_[next_[f]].to <= here) ++next_[f];
      if (next_[f] == ends_[f]) continue;
      const Step& step = steps_[next_[f]];
      if (step.from <= here) {
        shine = shine + step.shine;
        inside = true;
      }
      until = std::min(until, step.from <= here ? step.to : step.from);
    }
    if (until == kNever) return;
    if (inside) append(here, until, shine);
    here = until;
  }
}

recon::Rgba RayLight::up_to(float distance) const {
  const auto at = std::lower_bound(stretches_.begin(), stretches_.end(), distance,
                                   [](const Stretch& s, float d) { return s.to < d; });
  if (at == stretches_.end()) return all();
  const recon::Rgba before = at == stretches_.begin() ? nothing() : (at - 1)->after;
  return distance <= at->from ? before : behind(before, at->shine, distance - at->from);
}

}  // namespace emberlock::apply
