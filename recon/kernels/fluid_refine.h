// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/kernels/fluid_grid.h"

namespace emberlock::recon {

/// The value in a cell (Axis -1) or at a face of a grid twice as fine: linear between those of the coarser
/// one that are around it. The floor's faces keep what they have.
template <class Value, int Axis>
struct Refine {
  const Value* coarse = nullptr;
  Value* fine = nullptr;
  FluidGrid from, to;

  HOST_DEVICE void operator()(int i, int j, int k) const {
    if (Axis == 2 && k == 0) return;
    fine[to.index(i, j, k)] =
        sample_linear(coarse, from, corner_below<Axis>(from, place<0>(i), place<1>(j), place<2>(k)));
  }

 private:
  /// A cell's middle, or a face along its own axis, in units of the coarser grid's indices.
  template <int Along>
  [[nodiscard]] HOST_DEVICE static float place(int at) {
    return 0.5F * static_cast<float>(at) - (Along == Axis ? 0.F : 0.25F);
  }
};

}  // namespace emberlock::recon
