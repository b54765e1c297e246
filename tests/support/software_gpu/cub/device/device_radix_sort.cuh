// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <numeric>

#include <cuda_runtime.h>

namespace cub {

struct DeviceRadixSort {
  template <class Key, class Value>
  static cudaError_t SortPairs(void* space, std::size_t& bytes, const Key* keys, Key* sorted_keys,
                               const Value* values, Value* sorted_values, std::size_t count, int first_bit,
                               int last_bit) {
    if (space == nullptr) {
      bytes = 1;
      return cudaSuccess;
    }
    software_gpu::enqueue([=] {
      const auto part = [=](Key key) {
        return key >> first_bit & ((std::uint64_t{1} << (last_bit - first_bit)) - 1);
      };
      std::vector<std::size_t> order(count);
      std::iota(order.begin(), order.end(), std::size_t{0});
      std::stable_sort(order.begin(), order.end(),
                       [&](std::size_t a, std::size_t b) { return part(keys[a]) < part(keys[b]); });
      for (std::size_t i = 0; i < count; ++i) {
        sorted_keys[i] = keys[order[i]];
        sorted_values[i] = values[order[i]];
      }
    });
    return cudaSuccess;
  }
};

}  // namespace cub
