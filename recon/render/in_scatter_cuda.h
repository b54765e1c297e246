// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/kernels/in_scatter.h"

namespace emberlock::recon {

// The passes of in-scatter on the GPU. Functors have pointers to the CPU's memory, to which results are
// copied back. All functions throw a DeviceError.

struct SweepWork {
  ArriveAt arrive;
  std::size_t shine = 0;  ///< number of values in arrive.grid.shine
  std::size_t ordinates = 0;
  std::size_t active = 0;
  const std::vector<float>* phase = nullptr;  ///< [row][ordinate]
};
/// Writes G of every row at the active points to `out`, [row][active point], and the arriving radiance to
/// `keep`, [ordinate][active point], unless it is null. Both must have their sizes.
void sweep_on_cuda(const SweepWork& work, std::vector<Rgba>& out, std::vector<Rgba>* keep);

/// For every active point; `out` is indexed by key point of the grid.
void at_active_on_cuda(const BluntTowards& blunt, std::size_t radiance, std::vector<Rgba>& out);
void at_active_on_cuda(const MixPeak& peak, std::size_t radiance, std::vector<Rgba>& out);

}  // namespace emberlock::recon
