// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/result.h"

namespace emberlock::recon {

/// Ok if the CUDA backend was built and this GPU answers; otherwise the Error says which is missing.
Status cuda_status(int gpu = 0);

/// The GPU of all that the calling thread does from here on. Throws a DeviceError.
void use_gpu(int gpu);

/// From here on the process keeps this much of that GPU's memory, what it uses counted, or half of what is
/// free: asked of the driver once, instead of piece by piece while a frame grows. Where the driver refuses,
/// nothing changes. Throws a DeviceError.
void reserve_gpu_memory(std::size_t bytes);
/// What the process keeps of it, in use or ready.
std::size_t reserved_gpu_memory();

/// Waits for all that the calling thread asked of its GPU. Throws a DeviceError.
void finish_gpu_work();

/// What this process has asked of its GPUs so far. A graph of launches counts as one.
struct GpuWork {
  std::uint64_t launches = 0;
  std::uint64_t uploads = 0, uploaded = 0;      ///< copies to the GPU, and their bytes
  std::uint64_t downloads = 0, downloaded = 0;  ///< copies to the CPU, which wait, and their bytes
};
GpuWork gpu_work();

}  // namespace emberlock::recon
