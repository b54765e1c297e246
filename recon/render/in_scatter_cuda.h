// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/kernels/in_scatter.h"

namespace emberlock::recon {

// In-scatter's passes on the GPU. Functors come with pointers to the CPU's memory, results go back there. All
// throw a DeviceError.

struct SweepWork {
  ArriveAt arrive;
  std::size_t shine = 0;  ///< values in arrive.grid.shine
  std::size_t ordinates = 0;
  std::size_t active = 0;
  const std::vector<float>* phase = nullptr;  ///< [row][ordinate]
};
/// G of every row at the active points into `out`, [row][active point], and what arrives there into `keep`,
/// [ordinate][active point], where it isn't null; both have their sizes.
void sweep_on_cuda(const SweepWork& work, std::vector<Rgba>& out, std::vector<Rgba>* keep);

/// For every active point; `out` at the grid's key points.
void at_active_on_cuda(const BluntTowards& blunt, std::size_t radiance, std::vector<Rgba>& out);
void at_active_on_cuda(const MixPeak& peak, std::size_t radiance, std::vector<Rgba>& out);

}  // namespace emberlock::recon
