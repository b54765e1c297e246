// SPDX-License-Identifier: Apache-2.0
// Kernels whose instructions tests/integration/cost_cuda counts in nvcc's output.
#include "tests/integration/cost/program/by_hand.h"

namespace emberlock {

template <class March>
__device__ void each_ray(const March& march, recon::Rgba* radiance, std::size_t rays) {
  const std::size_t ray = blockIdx.x * std::size_t{blockDim.x} + threadIdx.x;
  if (ray < rays) radiance[ray] = march(ray);
}
template <class Act>
__device__ void each_sample(const Act& act, std::size_t samples) {
  const std::size_t sample = blockIdx.x * std::size_t{blockDim.x} + threadIdx.x;
  if (sample < samples) act(sample);
}
template <class Extinction>
using LayAsideUnder = recon::LayAside<float, recon::StraightPath, recon::AdjointWeight<float, Extinction>>;

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
__global__ void adjoint_none(LayAsideUnder<recon::NoExtinction<float>> act, std::size_t samples) {
  each_sample(act, samples);
}
__global__ void adjoint_by_hand(LayAsideByHand act, std::size_t samples) { each_sample(act, samples); }
__global__ void adjoint_constant(LayAsideUnder<recon::ConstantExtinction<float>> act, std::size_t samples) {
  each_sample(act, samples);
}

}  // extern "C"

}  // namespace emberlock
