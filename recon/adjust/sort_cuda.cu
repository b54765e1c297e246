// SPDX-License-Identifier: Apache-2.0
#include <bit>

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "recon/adjust/sort_cuda.h"
#include "recon/compute/cuda_launch.h"
#include "recon/compute/cuda_space.h"

namespace emberlock::recon {
SortedSamples sort_by_voxel(const CudaBuffer<std::uint32_t>& voxels, std::size_t key_points) {
  const std::size_t count = voxels.size();
  SortedSamples sorted{
      CudaBuffer<std::uint32_t>::unfilled(count), {}, CudaBuffer<std::uint32_t>(key_points + 1)};
  const auto sorted_voxels = CudaBuffer<std::uint32_t>::unfilled(count);
  if (count > 0) {
    const auto numbers = CudaBuffer<std::uint32_t>::unfilled(count);
    launch(count, Number{numbers.data()}, "numbering samples");
    with_space(
        [&](void* space, std::size_t& bytes) {
          return cub::DeviceRadixSort::SortPairs(space, bytes, voxels.data(), sorted_voxels.data(),
                                                 numbers.data(), sorted.order.data(), count, 0,
                                                 static_cast<int>(std::bit_width(key_points)));
        },
        "sorting samples");
  }
  const auto begin = CudaBuffer<std::uint32_t>::unfilled(key_points + 1);
  launch(key_points + 1, FindBegin<>{sorted_voxels.data(), static_cast<std::uint32_t>(count), begin.data()},
         "finding voxels");
  launch(key_points, HasSamples{begin.data(), sorted.place.data()}, "finding voxels");
  with_space(
      [&](void* space, std::size_t& bytes) {
        return cub::DeviceScan::ExclusiveSum(space, bytes, sorted.place.data(), key_points + 1);
      },
      "counting voxels");
  sorted.begin = CudaBuffer<std::uint32_t>::unfilled(sorted.place.download_one(key_points) + std::size_t{1});
  launch(key_points + 1, ListBegin{begin.data(), sorted.place.data(), key_points, sorted.begin.data()},
         "listing voxels");
  return sorted;
}

}  // namespace emberlock::recon
