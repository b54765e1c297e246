// SPDX-License-Identifier: Apache-2.0
#include "recon/compute/cuda_launch.h"
#include "recon/hull/gpu_rays.h"
#include "recon/render/render_cuda.h"

namespace emberlock::recon {
namespace {

template <class Path, class Extinction>
MarchedRays march(const RayList& list, const std::vector<Rgba>& source, const Extinction& extinction) {
  using March = Forward<float, Extinction, Path>;
  const auto rays = GpuRays::of(list);
  const CudaBuffer<Rgba> volume(source);
  const auto seen = CudaBuffer<Rgba>::unfilled(list.count().rays);
  launch(seen.size(),
         MarchAndKeep<March, KeepRadiance<float>>{{rays->table(), volume.data(), extinction}, {seen.data()}},
         "marching");
  return {seen.download(), rays->pixels.download()};
}

template <class Extinction>
MarchedRays march(const RayList& list, const std::vector<Rgba>& source, const Extinction& extinction) {
  return list.curved ? march<CurvedPath>(list, source, extinction)
                     : march<StraightPath>(list, source, extinction);
}

}  // namespace

MarchedRays march_on_cuda(const RayList& list, const std::vector<Rgba>& source, Absorb absorb, float sigma) {
  switch (absorb) {
    case Absorb::field:
      return march(list, source, FieldExtinction<float>{});
    case Absorb::constant:
      return march(list, source, ConstantExtinction<float>{sigma});
    case Absorb::nothing:
      break;
  }
  return march(list, source, NoExtinction<float>{});
}

}  // namespace emberlock::recon
