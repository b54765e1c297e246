// SPDX-License-Identifier: Apache-2.0
#include <bit>

#include <cub/device/device_radix_sort.cuh>

#include "recon/adjust/sort_cuda.h"
#include "recon/compute/cuda_launch.h"
#include "recon/kernels/gather.h"

namespace emberlock::recon {

SortedSamples sort_by_voxel(const CudaBuffer<std::uint32_t>& voxels, std::size_t key_points) {
  const std::size_t count = voxels.size();
  SortedSamples sorted{CudaBuffer<std::uint32_t>::unfilled(count),
                       CudaBuffer<std::uint32_t>::unfilled(key_points + 1)};
  const auto sorted_voxels = CudaBuffer<std::uint32_t>::unfilled(count);
  if (count > 0) {
    const auto numbers = CudaBuffer<std::uint32_t>::unfilled(count);
    launch(count, Number{numbers.data()}, "numbering samples");
    std::size_t bytes = 0;
    const auto sort = [&](void* space) {
      check_cuda(
          cub::DeviceRadixSort::SortPairs(space, bytes, voxels.data(), sorted_voxels.data(), numbers.data(),
                                          sorted.order.data(), count, 0, std::bit_width(key_points)),
          "sorting samples");
    };
    sort(nullptr);
    sort(CudaBuffer<std::uint8_t>::unfilled(bytes).data());
  }
  launch(key_points + 1,
         FindBegin{sorted_voxels.data(), static_cast<std::uint32_t>(count), sorted.begin.data()},
         "finding voxels");
  return sorted;
}

}  // namespace emberlock::recon
