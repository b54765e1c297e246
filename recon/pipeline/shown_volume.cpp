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

}  // namespace

Result<ShownVolume> read_shown_volume(const fs::path& result) {
  std::error_code ec;
  const fs::path file = fs::is_directory(result, ec) ? result / "volume.vdb" : result;
  ShownVolume shown;
  EMBERLOCK_ASSIGN_OR_RETURN(shown.volume, read_volume(file));
  EMBERLOCK_ASSIGN_OR_RETURN(auto kelvin, read_values(file, "temperature", shown.volume.grid));
  if (kelvin) shown.kelvin = std::move(*kelvin);
  return shown;
}

Box box_of(const Grid& grid) {
  const Eigen::Vector3d origin(grid.origin[0], grid.origin[1], grid.origin[2]);
  const Eigen::Vector3d size =
      static_cast<double>(grid.edge) * Eigen::Vector3d(grid.nx - 1, grid.ny - 1, grid.nz - 1);
  return {origin + size / 2, size};
}

LightViews::LightViews(Volume volume, const ComputeOptions& compute)
    : volume_(std::move(volume)), dark_{volume_.grid, {}, volume_.extinction}, compute_(compute) {
  if (!dark_.extinction.empty()) dark_.emission.resize(volume_.emission.size());
}

std::vector<ShownView> LightViews::of(const std::vector<const CameraModel*>& cameras) const {
  std::vector<ShownView> views;
  for (RadianceImage& light : rendered(volume_, {}, cameras, compute_)) {
    std::vector<float> opacity(light.rgb.size() / 3);
    views.push_back({std::move(light), std::move(opacity)});
  }
  if (dark_.extinction.empty()) return views;
  const Background white{Background::Kind::constant, {kWhite, kWhite, kWhite}};
  const std::vector<RadianceImage> through = rendered(dark_, white, cameras, compute_);
  for (std::size_t v = 0; v < views.size(); ++v)
    for (std::size_t i = 0; i < views[v].opacity.size(); ++i)
      views[v].opacity[i] = std::clamp(1 - through[v].rgb[3 * i] / kWhite, 0.0F, 1.0F);
  return views;
}

TemperatureViews::TemperatureViews(const ShownVolume& shown, const ComputeOptions& compute)
    : weighted_{shown.volume.grid, std::vector<float>(shown.volume.emission.size()), shown.volume.extinction},
      compute_(compute) {
  for (std::size_t p = 0; p < shown.kelvin.size(); ++p) {
    if (!(shown.kelvin[p] > 0)) continue;
    const float* rgb = &shown.volume.emission[3 * p];
    const float light = std::max({rgb[0], rgb[1], rgb[2]});
    weighted_.emission[3 * p] = light * shown.kelvin[p];
    weighted_.emission[3 * p + 1] = light;
  }
}

std::vector<std::vector<float>> TemperatureViews::of(const std::vector<const CameraModel*>& cameras,
                                                     float least) const {
  std::vector<std::vector<float>> views;
  for (const RadianceImage& sum : rendered(weighted_, {}, cameras, compute_)) {
    std::vector<float>& kelvin = views.emplace_back(sum.rgb.size() / 3);
    for (std::size_t i = 0; i < kelvin.size(); ++i) {
      const float light = sum.rgb[3 * i + 1];
      if (light > 0 && light >= least) kelvin[i] = sum.rgb[3 * i] / light;
    }
  }
  return views;
}

float TemperatureViews::least_light(const std::vector<CameraModel>& cameras) const {
  constexpr float kShare = 0.02F;
  constexpr int kLongest = 96;
  constexpr std::size_t kAtOnce = 64;
  float brightest = 0;
  for (std::size_t first = 0; first < cameras.size(); first += kAtOnce) {
    std::vector<CameraModel> small;
    for (std::size_t i = first; i < std::min(cameras.size(), first + kAtOnce); ++i) {
      const ImageSize size = cameras[i].intrinsics.size;
      const int widest = std::max(1, kLongest * size.width / std::max(size.width, size.height));
      small.push_back(resized(cameras[i], preview_size(size, widest)));
    }
    std::vector<const CameraModel*> these;
    these.reserve(small.size());
    for (const CameraModel& camera : small) these.push_back(&camera);
    for (const RadianceImage& sum : rendered(weighted_, {}, these, compute_))
      for (std::size_t i = 1; i < sum.rgb.size(); i += 3) brightest = std::max(brightest, sum.rgb[i]);
  }
  return kShare * brightest;
}

}  // namespace emberlock::recon
