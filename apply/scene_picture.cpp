// SPDX-License-Identifier: Apache-2.0
#include "apply/scene_picture.h"

#include <algorithm>
#include <cmath>

#include "apply/bvh.h"
#include "apply/kernels/trace_pixel.h"
#include "apply/light_tables.h"
#include "apply/scene_cuda.h"
#include "recon/hull/kernel_views.h"

namespace emberlock::apply {
namespace {

Vec3 vec3_of(const Eigen::Vector3d& v) {
  const Eigen::Vector3f f = v.cast<float>();
  return {f[0], f[1], f[2]};
}

PixelTask task_of(const Surroundings& around, const recon::CameraModel& camera, const PictureOptions& options,
                  ScenePicture& picture) {
  PixelTask task;
  task.surfaces = around.surfaces.table();
  task.camera = recon::pixel_rays(camera);
  task.eye = vec3_of(camera.center());
  task.background = vec3_of({around.background[0], around.background[1], around.background[2]});
  task.samples = options.samples;
  task.seed = options.seed;
  task.bare = around.surfaces.empty();
  task.rgb = picture.light.rgb.data();
  task.opacity = picture.opacity.data();
  task.error = picture.error.data();
  return task;
}

/// What a GPU needs of the surfaces; a tree for those that aren't there yet.
SurfaceWork surface_work(const Surfaces& surfaces, const Bvh& bvh) {
  const Mesh& mesh = surfaces.mesh();
  return {surfaces.table(),
          mesh.vertices.size(),
          mesh.triangles.size(),
          surfaces.materials().size(),
          surfaces.textures().size(),
          surfaces.texels().size(),
          bvh.view(),
          bvh.nodes.size(),
          &surfaces.on_gpu()};
}

[[maybe_unused]] void on_cuda(const std::vector<const Flame*>& flames, const std::vector<Flame::View>& views,
                              const LightTables& tables, const Surfaces& surfaces, const PixelTask& task,
                              std::size_t pixels) {
  std::vector<FlameWork> work;
  for (std::size_t f = 0; f < flames.size(); ++f)
    work.push_back({tables.flames[f], &views[f].rays, views[f].source, &flames[f]->coarse_shine(),
                    &flames[f]->on_gpu()});
  Bvh bvh;
  if (!surfaces.on_gpu() && !surfaces.empty()) {
    Result<Bvh> built = build_bvh(surfaces.mesh());
    if (!built) throw recon::DeviceError(built.error());
    bvh = std::move(built).value();
  }
  trace_on_cuda(work, tables.view(), surface_work(surfaces, bvh), task, pixels);
}

template <class Trace>
void on_cpu(const Trace& trace, ImageSize size, recon::Pool& pool) {
  const auto width = static_cast<std::size_t>(size.width);
  pool.run(size.height, [&](int y) {
    for (std::size_t x = 0; x < width; ++x) trace(static_cast<std::size_t>(y) * width + x);
  });
}

}  // namespace

ScenePicture scene_picture(const std::vector<const Flame*>& flames, const Surroundings& around,
                           const recon::CameraModel& camera, const PictureOptions& options,
                           recon::Pool& pool) {
  const ImageSize size = camera.intrinsics.size;
  ScenePicture picture{recon::RadianceImage(size), {}, {}};
  picture.opacity.resize(picture.light.rgb.size() / 3);
  picture.error.resize(picture.opacity.size());
  LightTables tables(flames, around.light, around.surfaces.glowing());
  std::vector<Flame::View> views;
  views.reserve(flames.size());
  for (std::size_t f = 0; f < flames.size(); ++f) {
    views.push_back(flames[f]->seen_by(camera, options.step, pool));
    tables.flames[f] = flames[f]->table(views[f]);
  }
  const PixelTask task = task_of(around, camera, options, picture);
  if constexpr (recon::kCudaBuilt) {
    if (pool.device() == recon::Device::cuda) {
      on_cuda(flames, views, tables, around.surfaces, task, picture.opacity.size());
      return picture;
    }
  }
  constexpr int kFew = 4;  // for whom less memory is touched
  const EmbreeTriangles triangles = around.surfaces.triangles();
  if (flames.size() <= kFew)
    on_cpu(TracePixel<EmbreeTriangles, kFew>{task, {tables.view(), triangles}}, size, pool);
  else
    on_cpu(TracePixel<EmbreeTriangles, kMostFlames>{task, {tables.view(), triangles}}, size, pool);
  return picture;
}

double rms_error(const ScenePicture& picture) {
  double sum_of_squares = 0;
  for (const float e : picture.error) sum_of_squares += static_cast<double>(e) * static_cast<double>(e);
  return picture.error.empty() ? 0 : std::sqrt(sum_of_squares / static_cast<double>(picture.error.size()));
}

}  // namespace emberlock::apply
