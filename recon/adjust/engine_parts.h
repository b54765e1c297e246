// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "recon/adjust/engine.h"
#include "recon/kernels/level.h"
#include "recon/kernels/pictures.h"
#include "recon/kernels/sum.h"

namespace emberlock::recon {

// What the engines of all devices make of sums and grids.

inline ResidualEngine::Squares squares_of(const Quad<double>& sum) { return {sum.c[0], sum.c[1], sum.c[2]}; }

/// Of a sum of values and how many counted; 0 of none.
inline float mean_of(const Quad<double>& sum) {
  return sum.c[1] > 0 ? static_cast<float>(sum.c[0] / sum.c[1]) : 0.F;
}

/// Of SeenTerm's sum.
inline float ratio(const Quad<double>& sum) {
  return sum.c[1] > 0 ? static_cast<float>(std::max(0.0, sum.c[0]) / sum.c[1]) : 0.F;
}

inline std::size_t most_rows(const std::vector<WeighedBox>& boxes) {
  int rows = 1;
  for (const WeighedBox& box : boxes) rows = std::max(rows, box.y1 - box.y0);
  return static_cast<std::size_t>(rows);
}

template <class Real>
RefineLight<Real> refinement(const Problem& from, const Problem& to, const float* share,
                             const Quad<Real>* coarse, Quad<Real>* fine) {
  RefineLight<Real> refine{from.grid(), to.grid(), {}, share, coarse, fine};
  for (int a = 0; a < 3; ++a) refine.shift[a] = to.crop.offset[a] - 2 * from.crop.offset[a];
  return refine;
}

}  // namespace emberlock::recon
