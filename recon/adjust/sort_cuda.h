// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "recon/compute/cuda_buffer.h"
#include "recon/kernels/gather.h"

namespace emberlock::recon {

/// See SamplesByVoxel.
struct SortedSamples {
  CudaBuffer<std::uint32_t> order;
  CudaBuffer<std::uint32_t> begin;
  CudaBuffer<std::uint32_t> place;

  [[nodiscard]] std::size_t voxels() const { return begin.size() - 1; }
  [[nodiscard]] SamplesByVoxel view() const { return {order.data(), begin.data(), place.data(), voxels()}; }
};

/// Sorts samples by their voxels (one each, < key_points); those of one voxel keep their order.
SortedSamples sort_by_voxel(const CudaBuffer<std::uint32_t>& voxels, std::size_t key_points);

}  // namespace emberlock::recon
