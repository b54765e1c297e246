// SPDX-License-Identifier: Apache-2.0
#include "recon/compute/cuda_launch.h"
#include "recon/render/in_scatter_cuda.h"

namespace emberlock::recon {

void sweep_on_cuda(const SweepWork& work, std::vector<Rgba>& out, std::vector<Rgba>* keep) {
  const CudaBuffer<Rgba> shine(work.arrive.grid.shine, work.shine);
  const CudaBuffer<Ordinate> ordinates(work.arrive.ordinates, work.ordinates);
  const CudaBuffer<Footstep> footsteps(work.arrive.footsteps, work.ordinates * work.arrive.reach);
  const CudaBuffer<std::size_t> active(work.arrive.active, work.active);
  const CudaBuffer<float> phase(*work.phase);
  const auto radiance = CudaBuffer<Rgba>::unfilled(work.ordinates * work.active);
  const auto scattered = CudaBuffer<Rgba>::unfilled(out.size());
  Arrive arrive{work.arrive, work.active, radiance.data()};
  arrive.at.grid.shine = shine.data();
  arrive.at.ordinates = ordinates.data();
  arrive.at.footsteps = footsteps.data();
  arrive.at.active = active.data();
  launch(radiance.size(), arrive, "sweeping");
  launch(
      scattered.size(),
      Scatter{phase.data(), static_cast<int>(work.ordinates), work.active, radiance.data(), scattered.data()},
      "scattering");
  scattered.download(out.data());
  if (keep != nullptr) radiance.download(keep->data());
}

void at_active_on_cuda(const BluntTowards& blunt, std::size_t radiance, std::vector<Rgba>& out) {
  const CudaBuffer<std::size_t> active(blunt.active, blunt.count);
  const CudaBuffer<Ordinate> ordinates(blunt.towards.ordinates,
                                       static_cast<std::size_t>(blunt.towards.count));
  const CudaBuffer<Rgba> light(blunt.radiance, radiance);
  const CudaBuffer<Rgba> to(out);
  BluntTowards on_device = blunt;
  on_device.active = active.data();
  on_device.towards.ordinates = ordinates.data();
  on_device.radiance = light.data();
  on_device.out = to.data();
  launch(blunt.count, on_device, "scattering towards a camera");
  to.download(out.data());
}

void at_active_on_cuda(const MixPeak& peak, std::size_t /*radiance*/, std::vector<Rgba>& out) {
  const CudaBuffer<std::size_t> active(peak.active, peak.count);
  const CudaBuffer<Rgba> shine(peak.grid.shine, out.size());
  const CudaBuffer<Rgba> to(out);
  MixPeak on_device = peak;
  on_device.active = active.data();
  on_device.grid.shine = shine.data();
  on_device.out = to.data();
  launch(peak.count, on_device, "marching a phase function's peak");
  to.download(out.data());
}

}  // namespace emberlock::recon
