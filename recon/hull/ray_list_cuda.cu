// SPDX-License-Identifier: Apache-2.0
#include <bit>

#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "recon/compute/cuda_launch.h"
#include "recon/compute/cuda_space.h"
#include "recon/hull/gpu_rays.h"
#include "recon/hull/ray_list_cuda.h"
#include "recon/kernels/gather.h"

namespace emberlock::recon {
namespace {

struct SumOfCounts {
  HOST_DEVICE RayCounts operator()(const RayCounts& a, const RayCounts& b) const { return a + b; }
};

/// Exclusive prefix sums.
CudaBuffer<RayCounts> sums_before(const CudaBuffer<RayCounts>& counts) {
  auto sums = CudaBuffer<RayCounts>::unfilled(counts.size());
  with_space(
      [&](void* space, std::size_t& bytes) {
        return cub::DeviceScan::ExclusiveScan(space, bytes, counts.data(), sums.data(), SumOfCounts{},
                                              RayCounts{}, static_cast<int>(counts.size()));
      },
      "adding up rays");
  return sums;
}

/// Pixels by subset, and the first of each, and their number.
struct GpuPixels {
  CudaBuffer<PixelOfView> pixels;
  CudaBuffer<std::uint32_t> first;
  std::size_t count = 0;
};

GpuPixels deal(const std::vector<TiledView>& views, const RayListOptions& options) {
  const TiledView& last = views.back();
  const std::size_t slots = last.first_slot + static_cast<std::size_t>(last.tiles_across()) *
                                                  static_cast<std::size_t>(last.tiles_down()) * kTile * kTile;
  const auto subsets = static_cast<std::size_t>(options.subsets);
  const CudaBuffer<TiledView> on_gpu(views);
  const PixelSlots of{on_gpu.data(), static_cast<std::uint32_t>(views.size()), options.rule};
  const auto subset = CudaBuffer<std::uint8_t>::unfilled(slots);
  const auto sorted_subset = CudaBuffer<std::uint8_t>::unfilled(slots);
  const auto slot = CudaBuffer<std::uint32_t>::unfilled(slots);
  const auto sorted_slot = CudaBuffer<std::uint32_t>::unfilled(slots);
  launch(slots, NameSubsets{of, static_cast<std::uint8_t>(options.subsets), subset.data()}, "dealing pixels");
  launch(slots, Number{slot.data()}, "numbering pixels");
  if (slots > 0)
    with_space(
        [&](void* space, std::size_t& bytes) {
          return cub::DeviceRadixSort::SortPairs(space, bytes, subset.data(), sorted_subset.data(),
                                                 slot.data(), sorted_slot.data(), slots, 0,
                                                 static_cast<int>(std::bit_width(subsets)));
        },
        "sorting pixels");
  GpuPixels dealt;
  dealt.first = CudaBuffer<std::uint32_t>::unfilled(subsets + 1);
  launch(subsets + 1,
         FindBegin<std::uint8_t>{sorted_subset.data(), static_cast<std::uint32_t>(slots), dealt.first.data()},
         "finding subsets");
  dealt.count = dealt.first.download_one(subsets);
  dealt.pixels = CudaBuffer<PixelOfView>::unfilled(dealt.count);
  launch(dealt.count, PlacePixels{of, sorted_slot.data(), dealt.pixels.data()}, "placing pixels");
  return dealt;
}

void cut(const CutRay& cut, const std::vector<PixelRays>& cameras, const GpuPixels& pixels,
         const RayListOptions& options, RayList& list) {
  list.curved = cut.gas.values != nullptr;
  const auto made = std::make_shared<GpuRays>(list);
  const CudaBuffer<std::uint8_t> inside(cut.voxels.inside, cut.voxels.size());
  const CudaBuffer<std::uint8_t> occupied(cut.blocks.inside, cut.blocks.size());
  const CudaBuffer<Rgba> gas(cut.gas.values, list.curved ? cut.gas.size() : 0);
  const CudaBuffer<PixelRays> on_gpu_cameras(cameras);
  CutPixels of{cut, on_gpu_cameras.data(), made->origins.data(), pixels.pixels.data()};
  of.cut.voxels.inside = inside.data();
  of.cut.blocks.inside = occupied.data();
  of.cut.gas.values = gas.data();

  // One more than the number of pixels: the last sum is the total.
  const CudaBuffer<RayCounts> counts(pixels.count + 1);
  launch(pixels.count, CountPixelRuns{of, counts.data()}, "counting runs");
  const CudaBuffer<RayCounts> before = sums_before(counts);
  const auto at_subsets = CudaBuffer<RayCounts>::unfilled(pixels.first.size());
  launch(at_subsets.size(), PickCounts{before.data(), pixels.first.data(), at_subsets.data()},
         "counting runs");
  list.before = at_subsets.download();
  for (const RayCounts& counted : list.before) list.subset_begin.push_back(counted.rays);

  const RayCounts& all = list.count();
  made->rays = CudaBuffer<MarchRay>::unfilled(all.rays);
  made->runs = CudaBuffer<Run>::unfilled(all.runs);
  made->bends = CudaBuffer<Bend>::unfilled(list.curved ? all.runs : 0);
  made->pixels = CudaBuffer<std::uint32_t>::unfilled(all.rays);
  launch(pixels.count,
         WritePixelRuns{of, before.data(), made->rays.data(), made->runs.data(), made->bends.data(),
                        made->pixels.data()},
         "writing runs");
  if (options.home == RayListOptions::Home::cpu) {
    list.rays = made->rays.download();
    list.runs = made->runs.download();
    list.bends = made->bends.download();
    list.pixels = made->pixels.download();
  }
  list.on_gpu = made;
}

}  // namespace

void cut_on_cuda(const CutRay& ray, const std::vector<PixelRays>& cameras, const PixelsInOrder& pixels,
                 const RayListOptions& options, RayList& list) {
  const std::vector<std::uint32_t> first(pixels.subset_begin.begin(), pixels.subset_begin.end());
  cut(ray, cameras,
      {CudaBuffer<PixelOfView>(pixels.pixels), CudaBuffer<std::uint32_t>(first), pixels.pixels.size()},
      options, list);
}

void cut_on_cuda(const CutRay& ray, const std::vector<PixelRays>& cameras,
                 const std::vector<TiledView>& views, const RayListOptions& options, RayList& list) {
  cut(ray, cameras, deal(views, options), options, list);
}

void lengths_on_cuda(const GpuRays& rays, std::vector<double>& sums) {
  const auto on_gpu = CudaBuffer<double>::unfilled(sums.size());
  launch(sums.size(), SumLengths{rays.runs.data(), rays.runs.size(), on_gpu.data()}, "adding up runs");
  on_gpu.download(sums.data());
}

}  // namespace emberlock::recon
