// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "recon/adjust/engine.h"
#include "recon/kernels/update.h"

namespace emberlock::recon {

/// What tells one pass' launches from another's.
struct Sweep {
  const void* y;
  const void* offset;
  std::vector<Engine::SubsetStep> steps;
  std::optional<Engine::FieldStep> field;

  friend bool operator==(const Sweep& a, const Sweep& b) {
    const auto same_step = [](const Engine::SubsetStep& s, const Engine::SubsetStep& t) {
      return s.subset == t.subset && s.step.scale == t.step.scale && s.step.length == t.step.length;
    };
    const auto same_field = [](const Engine::FieldStep& s, const Engine::FieldStep& t) {
      return s.variation == t.variation && s.soft == t.soft && s.most == t.most;
    };
    return a.y == b.y && a.offset == b.offset && a.field.has_value() == b.field.has_value() &&
           (!a.field || same_field(*a.field, *b.field)) &&
           std::equal(a.steps.begin(), a.steps.end(), b.steps.begin(), b.steps.end(), same_step);
  }
};

template <class Real>
HOST_DEVICE inline void set_momentum(Descend<Real>& step, float momentum) {
  step.momentum = Real(momentum);
}
template <class Real>
HOST_DEVICE inline void set_momentum(DescendField<Real>& step, float momentum) {
  step.emission.momentum = Real(momentum);
}
/// A step whose momentum lies on the GPU.
template <class Update>
struct WithMomentum {
  Update step;
  const float* momentum = nullptr;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    Update now = step;
    set_momentum(now, *momentum);
    now(i, j, k);
  }
};

}  // namespace emberlock::recon
