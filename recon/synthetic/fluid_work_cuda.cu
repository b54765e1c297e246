// SPDX-License-Identifier: Apache-2.0
#include "recon/compute/cuda_launch.h"
#include "recon/kernels/combustion.h"
#include "recon/kernels/fluid_diffusion.h"
#include "recon/kernels/fluid_forces.h"
#include "recon/kernels/fluid_pressure.h"
#include "recon/kernels/fluid_refine.h"
#include "recon/kernels/fluid_transport.h"
#include "recon/synthetic/fluid_work_cuda.h"

namespace emberlock::recon {
namespace {

void free_gpu_memory(void* data) noexcept { cuda_free(data); }

/// act(i, j, k) from one number.
template <class Act>
struct AtIndices {
  Act act;
  FluidRange range;

  HOST_DEVICE void operator()(std::size_t at) const {
    const auto nx = static_cast<std::size_t>(range.nx);
    const auto ny = static_cast<std::size_t>(range.ny);
    act(static_cast<int>(at % nx), static_cast<int>(at / nx % ny), static_cast<int>(at / (nx * ny)));
  }
};

}  // namespace

GpuMemory gpu_memory(std::size_t bytes) {
  GpuMemory memory(cuda_allocate(bytes), free_gpu_memory);
  check_cuda(cudaMemsetAsync(memory.get(), 0, bytes), "clearing memory of the GPU");
  return memory;
}
void copy_to_gpu(void* to, const void* from, std::size_t bytes) {
  cuda_copy(to, from, bytes, cudaMemcpyHostToDevice);
}
void copy_from_gpu(void* to, const void* from, std::size_t bytes) {
  cuda_copy(to, from, bytes, cudaMemcpyDeviceToHost);
}

template <class Act>
void each_on_gpu(const FluidRange& range, const Act& act) {
  launch(range.size(), AtIndices<Act>{act, range}, "a fluid's pass");
}

template void each_on_gpu(const FluidRange&, const Transport&);
template void each_on_gpu(const FluidRange&, const TraceBack<float, -1>&);  // of tests
template void each_on_gpu(const FluidRange&, const TraceBack<float, 0>&);
template void each_on_gpu(const FluidRange&, const TraceBack<float, 1>&);
template void each_on_gpu(const FluidRange&, const TraceBack<float, 2>&);
template void each_on_gpu(const FluidRange&, const CorrectTrace<float, -1>&);
template void each_on_gpu(const FluidRange&, const CorrectTrace<float, 0>&);
template void each_on_gpu(const FluidRange&, const CorrectTrace<float, 1>&);
template void each_on_gpu(const FluidRange&, const CorrectTrace<float, 2>&);
template void each_on_gpu(const FluidRange&, const Refine<Rgba, -1>&);
template void each_on_gpu(const FluidRange&, const Refine<float, -1>&);
template void each_on_gpu(const FluidRange&, const Refine<float, 0>&);
template void each_on_gpu(const FluidRange&, const Refine<float, 1>&);
template void each_on_gpu(const FluidRange&, const Refine<float, 2>&);
template void each_on_gpu(const FluidRange&, const EddyDiffusion&);
template void each_on_gpu(const FluidRange&, const DiffuseFaces<0>&);
template void each_on_gpu(const FluidRange&, const DiffuseFaces<1>&);
template void each_on_gpu(const FluidRange&, const DiffuseFaces<2>&);
template void each_on_gpu(const FluidRange&, const DiffuseGas&);
template void each_on_gpu(const FluidRange&, const Burn&);
template void each_on_gpu(const FluidRange&, const Buoyancy&);
template void each_on_gpu(const FluidRange&, const Vorticity&);
template void each_on_gpu(const FluidRange&, const Confinement&);
template void each_on_gpu(const FluidRange&, const Accelerate<0>&);
template void each_on_gpu(const FluidRange&, const Accelerate<1>&);
template void each_on_gpu(const FluidRange&, const Accelerate<2>&);
template void each_on_gpu(const FluidRange&, const FaceCoefficients<0>&);
template void each_on_gpu(const FluidRange&, const FaceCoefficients<1>&);
template void each_on_gpu(const FluidRange&, const FaceCoefficients<2>&);
template void each_on_gpu(const FluidRange&, const CoarsenCoefficients<0>&);
template void each_on_gpu(const FluidRange&, const CoarsenCoefficients<1>&);
template void each_on_gpu(const FluidRange&, const CoarsenCoefficients<2>&);
template void each_on_gpu(const FluidRange&, const InvertDiagonal&);
template void each_on_gpu(const FluidRange&, const DivergenceError&);
template void each_on_gpu(const FluidRange&, const SubtractGradient<0>&);
template void each_on_gpu(const FluidRange&, const SubtractGradient<1>&);
template void each_on_gpu(const FluidRange&, const SubtractGradient<2>&);
template void each_on_gpu(const FluidRange&, const RelaxColour&);
template void each_on_gpu(const FluidRange&, const RelaxFirst&);
template void each_on_gpu(const FluidRange&, const RestrictResidual&);
template void each_on_gpu(const FluidRange&, const ProlongCorrection&);
template void each_on_gpu(const FluidRange&, const SetZero&);
template void each_on_gpu(const FluidRange&, const NextDirection&);
template void each_on_gpu(const FluidRange&, const SumRow<ApplyEquation>&);
template void each_on_gpu(const FluidRange&, const SumRow<DescendAlong>&);
template void each_on_gpu(const FluidRange&, const SumRow<TwoProducts>&);
template void each_on_gpu(const FluidRange&, const SumRow<SumCells>&);
template void each_on_gpu(const FluidRange&, const GreatestOfRow<Extremes>&);

}  // namespace emberlock::recon
