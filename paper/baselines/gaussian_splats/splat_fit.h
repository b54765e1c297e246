// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "paper/baselines/gaussian_splats/splats.h"
#include "recon/compute/pool.h"
#include "recon/hull/medium.h"

namespace emberlock::paper {

struct SplatFitOptions {
  int iterations = 120;
  std::size_t first = 8000;  ///< splats to begin with, about; at most one a voxel of the hull
  double growth = 1.5;       ///< splats over those at the beginning, at most
  std::uint64_t seed = 1;
  std::function<bool()> stop = {};
};

struct SplatFit {
  Splats splats;
  int iterations = 0;
};

/// Splats on a lattice in the hull, about `count`, as bright as a few steps of a tomography without negative
/// light make them.
Splats splats_in(const recon::Hull& hull, const std::vector<SplatView>& views, std::size_t count,
                 recon::Pool& pool);

/// Fits splats to the views by the squares of what their pictures differ by, with Adam (Kingma and Ba 2015);
/// each step looks at other pixels of all views. In the first half of the steps splats whose centres are
/// drawn most become two, and those that hardly shine go. The views' pictures are the hull's grid's.
SplatFit fit_splats(const recon::Hull& hull, const std::vector<SplatView>& views,
                    const SplatFitOptions& options, recon::Pool& pool);

}  // namespace emberlock::paper
