// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "recon/compute/cuda_buffer.h"

namespace emberlock::recon {

/// For .cu files: calls one of CUB's functions twice, for the size of its working space, and with it.
template <class Call>
void with_space(const Call& call, const char* what) {
  std::size_t bytes = 0;
  check_cuda(call(nullptr, bytes), what);
  const auto space = CudaBuffer<std::uint8_t>::unfilled(bytes);
  check_cuda(call(space.data(), bytes), what);
}

}  // namespace emberlock::recon
