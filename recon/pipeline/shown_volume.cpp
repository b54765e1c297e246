// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/shown_volume.h"

#include <algorithm>

#include "recon/export/preview.h"
#include "recon/export/volume_file.h"
#include "recon/render/render.h"

namespace emberlock::recon {
namespace {

namespace fs = std::filesystem;

constexpr float kWhite = 255;

/// The extinction is in the volume, so it is marched as a field.
std::vector<RadianceImage> rendered(const Volume& volume, const Background& background,
                                    const std::vector<const CameraModel*>& cameras,
                                    const ComputeOptions& compute) {
  Effects effects;
  if (!volume.extinction.empty()) effects.extinction.model = Extinction::Model::field;
  effects.background = background;
  RenderOptions options;
  options.compute = compute;
  return render_views(volume, whole_grid(volume.grid), effects, cameras,
                      std::vector<const RadianceImage*>(cameras.size()), options);
}

/// Its red is the light of what tells a temperature times that, its green the light.
Volume weighted(const ShownVolume& shown) {
  Volume out{shown.volume.grid, std::vector<float>(shown.volume.emission.size()), shown.volume.extinction};
  for (std::size_t p = 0; p < shown.kelvin.size(); ++p) {
    if (!(shown.kelvin[p] > 0)) continue;
    const float* rgb = &shown.volume.emission[3 * p];
    const float light = std::max({rgb[0], rgb[1], rgb[2]});
    out.emission[3 * p] = light * shown.kelvin[p];
    out.emission[3 * p + 1] = light;
  }
  return out;
}

}  // namespace

Result<ShownVolume> read_shown_volume(const fs::path& result) {
  std::error_code ec;
  const fs::path file = fs::is_directory(result, ec) ? result / "volume.vdb" : result;
  ShownVolume shown;
  EMBERLOCK_ASSIGN_OR_RETURN(shown.volume, read_volume(file));
  if (auto kelvin = read_grid(file, "temperature")) shown.kelvin = std::move(*kelvin);
  return shown;
}

Box box_of(const Grid& grid) {
  const Eigen::Vector3d origin(grid.origin[0], grid.origin[1], grid.origin[2]);
  const Eigen::Vector3d size =
      static_cast<double>(grid.edge) * Eigen::Vector3d(grid.nx - 1, grid.ny - 1, grid.nz - 1);
  return {origin + size / 2, size};
}

std::vector<ShownView> show(const Volume& volume, const std::vector<const CameraModel*>& cameras,
                            const ComputeOptions& compute) {
  std::vector<ShownView> views;
  for (RadianceImage& light : rendered(volume, {}, cameras, compute)) {
    std::vector<float> opacity(light.rgb.size() / 3);
    views.push_back({std::move(light), std::move(opacity)});
  }
  if (volume.extinction.empty()) return views;
  // What comes through of a white background, without the volume's own light.
  const Volume dark{volume.grid, std::vector<float>(volume.emission.size()), volume.extinction};
  const Background white{Background::Kind::constant, {kWhite, kWhite, kWhite}};
  const std::vector<RadianceImage> through = rendered(dark, white, cameras, compute);
  for (std::size_t v = 0; v < views.size(); ++v)
    for (std::size_t i = 0; i < views[v].opacity.size(); ++i)
      views[v].opacity[i] = std::clamp(1 - through[v].rgb[3 * i] / kWhite, 0.0F, 1.0F);
  return views;
}

std::vector<std::vector<float>> show_kelvin(const ShownVolume& shown,
                                            const std::vector<const CameraModel*>& cameras, float least_light,
                                            const ComputeOptions& compute) {
  std::vector<std::vector<float>> views;
  for (const RadianceImage& sum : rendered(weighted(shown), {}, cameras, compute)) {
    std::vector<float>& kelvin = views.emplace_back(sum.rgb.size() / 3);
    for (std::size_t i = 0; i < kelvin.size(); ++i) {
      const float light = sum.rgb[3 * i + 1];
      if (light > 0 && light >= least_light) kelvin[i] = sum.rgb[3 * i] / light;
    }
  }
  return views;
}

float least_light(const ShownVolume& shown, const std::vector<const CameraModel*>& cameras,
                  const ComputeOptions& compute) {
  constexpr float kShare = 0.02F;
  constexpr int kWidest = 96;
  std::vector<CameraModel> small;
  for (const CameraModel* camera : cameras)
    small.push_back(resized(*camera, preview_size(camera->intrinsics.size, kWidest)));
  std::vector<const CameraModel*> all;
  for (const CameraModel& camera : small) all.push_back(&camera);
  float brightest = 0;
  for (const RadianceImage& sum : rendered(weighted(shown), {}, all, compute))
    for (std::size_t i = 1; i < sum.rgb.size(); i += 3) brightest = std::max(brightest, sum.rgb[i]);
  return kShare * brightest;
}

}  // namespace emberlock::recon
