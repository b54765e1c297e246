// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "apply/kernels/trace_pixel.h"
#include "recon/hull/ray_list.h"

namespace emberlock::apply {

/// What a flame and a mesh keep in a GPU's memory from picture to picture.
struct FlameOnGpu;
struct SurfacesOnGpu;

/// A flame as one camera sees it: what the table points to is in the CPU's memory, but for the rays.
struct FlameWork {
  FlameTable table;
  const recon::RayList* rays;
  std::shared_ptr<const std::vector<recon::Rgba>> source;
  const std::vector<recon::Rgba>* coarse;
  std::shared_ptr<FlameOnGpu>* kept;
};
/// A mesh in the CPU's memory; its tree is read where nothing of it is kept yet.
struct SurfaceWork {
  SurfaceTable table;
  std::size_t vertices = 0, triangles = 0, materials = 0, textures = 0, texel_bytes = 0;
  BvhTriangles bvh;
  std::size_t nodes = 0;
  std::shared_ptr<SurfacesOnGpu>* kept = nullptr;
};

/// TracePixel of all pixels on a GPU; `task`'s picture is in the CPU's memory. Throws a DeviceError.
void trace_on_cuda(const std::vector<FlameWork>& flames, const LightTable& lights,
                   const SurfaceWork& surfaces, const PixelTask& task, std::size_t pixels);

}  // namespace emberlock::apply
