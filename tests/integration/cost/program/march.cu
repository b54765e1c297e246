// SPDX-License-Identifier: Apache-2.0
// Kernels whose instructions tests/integration/cost_cuda counts in nvcc's output.
#include "tests/integration/cost/program/by_hand.h"

namespace emberlock {

template <class March>
__device__ void each_ray(const March& march, recon::Rgba* radiance, std::size_t rays) {
  const std::size_t ray = blockIdx.x * std::size_t{blockDim.x} + threadIdx.x;
  if (ray < rays) radiance[ray] = march(ray);
}
template <class March>
__device__ void each_run(const March& march, std::size_t runs) {
  const std::size_t run = blockIdx.x * std::size_t{blockDim.x} + threadIdx.x;
  if (run < runs) march(run);
}

extern "C" {

__global__ void forward_none(recon::Forward<float, recon::NoExtinction<float>, recon::StraightPath> march,
                             recon::Rgba* radiance, std::size_t rays) {
  each_ray(march, radiance, rays);
}
__global__ void forward_by_hand(ForwardByHand march, recon::Rgba* radiance, std::size_t rays) {
  each_ray(march, radiance, rays);
}
__global__ void forward_constant(
    recon::Forward<float, recon::ConstantExtinction<float>, recon::StraightPath> march, recon::Rgba* radiance,
    std::size_t rays) {
  each_ray(march, radiance, rays);
}
__global__ void adjoint_none(recon::Adjoint<float, recon::NoExtinction<float>, recon::StraightPath> march,
                             std::size_t runs) {
  each_run(march, runs);
}
__global__ void adjoint_by_hand(AdjointByHand<> march, std::size_t runs) { each_run(march, runs); }
__global__ void adjoint_constant(
    recon::Adjoint<float, recon::ConstantExtinction<float>, recon::StraightPath> march, std::size_t runs) {
  each_run(march, runs);
}

}  // extern "C"

}  // namespace emberlock
