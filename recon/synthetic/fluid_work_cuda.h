// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

namespace emberlock::recon {

/// A box of indices: i in 0..nx - 1, and so on; i runs fastest.
struct FluidRange {
  int nx = 0, ny = 0, nz = 0;

  [[nodiscard]] std::size_t size() const {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz);
  }
};

// What a FluidWork asks of a GPU. All of it throws a DeviceError.

using GpuMemory = std::unique_ptr<void, void (*)(void*) noexcept>;
/// Filled with zero bytes.
GpuMemory gpu_memory(std::size_t bytes);
void copy_to_gpu(void* to, const void* from, std::size_t bytes);
void copy_from_gpu(void* to, const void* from, std::size_t bytes);

/// Calls act(i, j, k), one thread a call. fluid_work_cuda.cu holds one for each functor.
template <class Act>
void each_on_gpu(const FluidRange& range, const Act& act);

}  // namespace emberlock::recon
