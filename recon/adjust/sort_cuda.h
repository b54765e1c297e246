// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "recon/compute/cuda_buffer.h"

namespace emberlock::recon {

/// See SamplesByVoxel.
struct SortedSamples {
  CudaBuffer<std::uint32_t> order;
  CudaBuffer<std::uint32_t> begin;
};

/// Sorts samples by their voxels (one each, < key_points); those of one voxel keep their order.
SortedSamples sort_by_voxel(const CudaBuffer<std::uint32_t>& voxels, std::size_t key_points);

}  // namespace emberlock::recon
