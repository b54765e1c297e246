// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "recon/compute/cuda_buffer.h"

namespace emberlock::recon {

// For .cu files: runs functors of recon/kernels on the GPU, one thread per call; on the GPU in software
// (tests/support/software_gpu) where they are compiled for that.

inline constexpr unsigned kThreadsABlock = 128;

#ifdef __CUDACC__
template <class Act>
__global__ void call_each(const Act act, std::size_t first, std::size_t last) {
  const std::size_t i = first + blockIdx.x * std::size_t{blockDim.x} + threadIdx.x;
  if (i < last) act(i);
}
#endif

/// Calls act(first) .. act(last - 1) concurrently in any order, on the calling
/// thread's stream. `what` names them in
/// errors.
template <class Act>
void launch(std::size_t first, std::size_t last, const Act& act, const char* what) {
  if (first >= last) return;
  ++counted_work().launches;
#ifdef __CUDACC__
  const std::size_t blocks = (last - first + kThreadsABlock - 1) / kThreadsABlock;
  call_each<<<static_cast<unsigned>(blocks), kThreadsABlock>>>(act, first, last);
#else
  software_gpu::launch(first, last, act);
#endif
  check_cuda(cudaGetLastError(), what);
}
template <class Act>
void launch(std::size_t count, const Act& act, const char* what) {
  launch(0, count, act, what);
}

}  // namespace emberlock::recon
