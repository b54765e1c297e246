// SPDX-License-Identifier: Apache-2.0
#include "apply/scene_cuda.h"
#include "recon/compute/cuda_launch.h"
#include "recon/hull/gpu_rays.h"

namespace emberlock::apply {

using recon::CudaBuffer;
using recon::Rgba;

struct FlameOnGpu {
  std::shared_ptr<const std::vector<Rgba>> source_of;  // what was copied
  CudaBuffer<Rgba> source, coarse;
};

struct SurfacesOnGpu {
  explicit SurfacesOnGpu(const SurfaceWork& work)
      : vertices(work.table.vertices, 3 * work.vertices),
        normals(work.table.normals, work.table.normals != nullptr ? 3 * work.vertices : 0),
        texture_places(work.table.texture_places,
                       work.table.texture_places != nullptr ? 2 * work.vertices : 0),
        linear(work.table.linear, 256),
        corners(work.bvh.corners, 9 * work.triangles),
        triangles(work.table.triangles, 3 * work.triangles),
        material(work.table.material, work.triangles),
        triangle(work.bvh.triangle, work.triangles),
        materials(work.table.materials, work.materials),
        textures(work.table.textures, work.textures),
        texels(work.table.texels, work.texel_bytes),
        nodes(work.bvh.nodes, work.nodes) {}

  [[nodiscard]] BvhTriangles bvh() const { return {nodes.data(), corners.data(), triangle.data()}; }
  [[nodiscard]] SurfaceTable table() const {
    return {vertices.data(),
            triangles.data(),
            material.data(),
            normals.size() > 0 ? normals.data() : nullptr,
            texture_places.size() > 0 ? texture_places.data() : nullptr,
            materials.data(),
            textures.data(),
            texels.data(),
            linear.data()};
  }

  CudaBuffer<float> vertices, normals, texture_places, linear, corners;
  CudaBuffer<std::uint32_t> triangles, material, triangle;
  CudaBuffer<MaterialRow> materials;
  CudaBuffer<TextureRow> textures;
  CudaBuffer<std::uint8_t> texels;
  CudaBuffer<BvhNode> nodes;
};

namespace {

/// The tables of flames in a GPU's memory, and what of them is of one picture alone.
class FlamesOfPicture {
 public:
  FlamesOfPicture(const std::vector<FlameWork>& flames, std::size_t pixels) {
    std::vector<FlameTable> tables;
    for (const FlameWork& work : flames) tables.push_back(copied(work, pixels));
    tables_ = CudaBuffer<FlameTable>(tables);
  }
  [[nodiscard]] const FlameTable* data() const { return tables_.data(); }

 private:
  FlameTable copied(const FlameWork& work, std::size_t pixels) {
    FlameTable table = work.table;
    if (!*work.kept) {
      *work.kept = std::make_shared<FlameOnGpu>();
      (*work.kept)->coarse = CudaBuffer<Rgba>(*work.coarse);
    }
    FlameOnGpu& kept = **work.kept;
    if (kept.source_of != work.source) {
      kept.source = CudaBuffer<Rgba>(*work.source);
      kept.source_of = work.source;
    }
    table.source = kept.source.data();
    table.coarse.shine = kept.coarse.data();
    auto ray_of_pixel = CudaBuffer<std::int32_t>::unfilled(pixels);
    recon::launch(pixels, NoRay{ray_of_pixel.data()}, "clearing pixels");
    if (table.there) {
      const auto rays = recon::GpuRays::of(*work.rays);
      table.rays = rays->table();
      recon::launch(rays->pixels.size(), NumberRay{rays->pixels.data(), ray_of_pixel.data()},
                    "numbering rays");
      rays_.push_back(rays);
    }
    table.ray_of_pixel = ray_of_pixel.data();
    pixels_.push_back(std::move(ray_of_pixel));
    return table;
  }

  CudaBuffer<FlameTable> tables_;
  std::vector<CudaBuffer<std::int32_t>> pixels_;
  std::vector<std::shared_ptr<const recon::GpuRays>> rays_;
};

/// With as few places for flames as are needed: every thread has its own.
template <int kMost>
void trace(const PixelTask& task, const LightTable& lights, const BvhTriangles& bvh, std::size_t pixels) {
  recon::launch(pixels, TracePixel<BvhTriangles, kMost>{task, {lights, bvh}}, "drawing a scene");
}

}  // namespace

void trace_on_cuda(const std::vector<FlameWork>& flames, const LightTable& lights,
                   const SurfaceWork& surfaces, const PixelTask& task, std::size_t pixels) {
  const FlamesOfPicture tables(flames, pixels);
  if (!*surfaces.kept) *surfaces.kept = std::make_shared<SurfacesOnGpu>(surfaces);
  const CudaBuffer<EmitterRow> emitters(lights.emitters, lights.glowing);
  const CudaBuffer<double> power_until(lights.power_until, lights.glowing);
  const CudaBuffer<std::uint32_t> guide(lights.guide, lights.shares);
  const CudaBuffer<GlowingTriangle> panels(lights.panels, lights.panel_count);
  LightTable there = lights;
  there.panels = panels.data();
  there.flames = tables.data();
  there.emitters = emitters.data();
  there.power_until = power_until.data();
  there.guide = guide.data();
  const auto rgb = CudaBuffer<float>::unfilled(3 * pixels);
  const auto opacity = CudaBuffer<float>::unfilled(pixels);
  const auto error = CudaBuffer<float>::unfilled(pixels);
  PixelTask on_gpu = task;
  on_gpu.surfaces = (*surfaces.kept)->table();
  on_gpu.rgb = rgb.data();
  on_gpu.opacity = opacity.data();
  on_gpu.error = error.data();
  const BvhTriangles bvh = task.bare ? BvhTriangles{} : (*surfaces.kept)->bvh();
  constexpr int kFew = 4;
  constexpr int kSome = 16;
  if (flames.size() <= kFew)
    trace<kFew>(on_gpu, there, bvh, pixels);
  else if (flames.size() <= kSome)
    trace<kSome>(on_gpu, there, bvh, pixels);
  else
    trace<kMostFlames>(on_gpu, there, bvh, pixels);
  rgb.download(task.rgb);
  opacity.download(task.opacity);
  error.download(task.error);
}

}  // namespace emberlock::apply
