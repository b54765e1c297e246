// SPDX-License-Identifier: Apache-2.0
#include <cub/device/device_scan.cuh>

#include "recon/compute/cuda_launch.h"
#include "recon/hull/ray_list_cuda.h"

namespace emberlock::recon {
namespace {

struct SumOfCounts {
  HOST_DEVICE RayCounts operator()(const RayCounts& a, const RayCounts& b) const { return a + b; }
};

/// Exclusive prefix sums.
CudaBuffer<RayCounts> sums_before(const CudaBuffer<RayCounts>& counts) {
  auto sums = CudaBuffer<RayCounts>::unfilled(counts.size());
  std::size_t bytes = 0;
  const auto scan = [&](void* space) {
    check_cuda(cub::DeviceScan::ExclusiveScan(space, bytes, counts.data(), sums.data(), SumOfCounts{},
                                              RayCounts{}, static_cast<int>(counts.size())),
               "adding up rays");
  };
  scan(nullptr);
  scan(CudaBuffer<std::uint8_t>::unfilled(bytes).data());
  return sums;
}

}  // namespace

void cut_on_cuda(const CutRay& cut, const std::vector<PixelRays>& cameras, const PixelsInOrder& pixels,
                 RayList& list) {
  list.subset_begin.assign(pixels.subset_begin.size(), 0);
  const std::size_t count = pixels.pixels.size();
  if (count == 0) return;
  const bool curved = cut.gas.values != nullptr;
  const CudaBuffer<std::uint8_t> inside(cut.voxels.inside, cut.voxels.size());
  const CudaBuffer<std::uint8_t> occupied(cut.blocks.inside, cut.blocks.size());
  const CudaBuffer<Rgba> gas(cut.gas.values, curved ? cut.gas.size() : 0);
  const CudaBuffer<PixelRays> on_device_cameras(cameras);
  const CudaBuffer<float> origins(list.origins);
  const CudaBuffer<PixelOfView> on_device_pixels(pixels.pixels);
  CutPixels of{cut, on_device_cameras.data(), origins.data(), on_device_pixels.data()};
  of.cut.voxels.inside = inside.data();
  of.cut.blocks.inside = occupied.data();
  of.cut.gas.values = gas.data();

  // One more than the number of pixels: the last sum is the total.
  const CudaBuffer<RayCounts> counts(count + 1);
  launch(count, CountPixelRuns{of, counts.data()}, "counting runs");
  const CudaBuffer<RayCounts> before = sums_before(counts);
  for (std::size_t s = 0; s < list.subset_begin.size(); ++s)
    list.subset_begin[s] = before.download_one(pixels.subset_begin[s]).rays;
  const RayCounts all = before.download_one(count);

  const auto rays = CudaBuffer<MarchRay>::unfilled(all.rays);
  const auto runs = CudaBuffer<Run>::unfilled(all.runs);
  const auto bends = CudaBuffer<Bend>::unfilled(curved ? all.runs : 0);
  const auto numbers = CudaBuffer<std::uint32_t>::unfilled(all.rays);
  launch(count, WritePixelRuns{of, before.data(), rays.data(), runs.data(), bends.data(), numbers.data()},
         "writing runs");
  list.rays = rays.download();
  list.runs = runs.download();
  list.bends = bends.download();
  list.pixels = numbers.download();
}

}  // namespace emberlock::recon
