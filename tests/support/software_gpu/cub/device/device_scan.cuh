// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

namespace cub {

struct DeviceScan {
  template <class T, class Add>
  static cudaError_t ExclusiveScan(void* space, std::size_t& bytes, const T* from, T* to, Add add, T start,
                                   std::size_t count) {
    if (space == nullptr) {
      bytes = 1;
      return cudaSuccess;
    }
    software_gpu::enqueue([=] {
      T sum = start;
      for (std::size_t i = 0; i < count; ++i) {
        const T next = add(sum, from[i]);
        to[i] = sum;
        sum = next;
      }
    });
    return cudaSuccess;
  }
  template <class T>
  static cudaError_t ExclusiveSum(void* space, std::size_t& bytes, T* values, std::size_t count) {
    return ExclusiveScan(
        space, bytes, values, values, [](T a, T b) { return static_cast<T>(a + b); }, T{}, count);
  }
};

}  // namespace cub
