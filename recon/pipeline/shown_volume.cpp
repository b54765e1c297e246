// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/shown_volume.h"

#include <algorithm>

#include "recon/export/preview.h"
#include "recon/export/volume_file.h"
#include "recon/hull/hull.h"
#include "recon/render/lit_medium.h"
#include "recon/render/render.h"

namespace emberlock::recon {
namespace {

namespace fs = std::filesystem;

constexpr float kWhite = 255;

/// The extinction is in the volume, so it is marched as a field.
Effects absorption_of(const Volume& volume) {
  Effects effects;
  if (!volume.extinction.empty()) effects.extinction.model = Extinction::Model::field;
  return effects;
}

std::vector<RadianceImage> rendered(const Volume& volume, const Hull& medium, const Effects& effects,
                                    const std::vector<const CameraModel*>& cameras,
                                    const RenderOptions& options) {
  return render_views(volume, medium, effects, cameras, std::vector<const RadianceImage*>(cameras.size()),
                      options);
}

/// The voxels that a ray crosses.
Hull medium_of(const Volume& volume) {
  return volume.inside.empty() ? whole_grid(volume.grid) : filled_voxels(volume);
}

std::vector<RadianceImage> weighted_sums(const Volume& weighted,
                                         const std::vector<const CameraModel*>& cameras,
                                         const ComputeOptions& compute) {
  RenderOptions options;
  options.compute = compute;
  return rendered(weighted, medium_of(weighted), absorption_of(weighted), cameras, options);
}

Eigen::Vector3d from_middle(const Light& light, const Box& box) {
  return Eigen::Vector3d(light.place[0], light.place[1], light.place[2]) - box.center;
}

/// What a light's strength is divided by in the middle of the grid, squared metres; one nearby is never taken
/// for nearer than a voxel's edge, as in light_that_reaches().
double spread_in_the_middle(const Light& light, const Grid& grid) {
  if (light.source != Light::Source::nearby) return 1;
  const auto edge = static_cast<double>(grid.edge);
  return std::max(from_middle(light, box_of(grid)).squaredNorm(), edge * edge);
}

}  // namespace

Result<ShownVolume> read_shown_volume(const fs::path& result) {
  std::error_code ec;
  const fs::path file = fs::is_directory(result, ec) ? result / "volume.vdb" : result;
  ShownVolume shown;
  EMBERLOCK_ASSIGN_OR_RETURN(shown.volume, read_volume(file));
  EMBERLOCK_ASSIGN_OR_RETURN(shown.lighting, read_lighting(file));
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

Hull filled_voxels(const Volume& volume) {
  const Grid& g = volume.grid;
  const auto holds = [&](std::size_t p) {
    const float* rgb = &volume.emission[3 * p];
    const bool absorbs = !volume.extinction.empty() && volume.extinction[p] > 0;
    return absorbs || rgb[0] > 0 || rgb[1] > 0 || rgb[2] > 0;
  };
  Hull medium = whole_grid(g);
  if (!volume.inside.empty()) {
    medium.inside = volume.inside;
    medium.count = static_cast<std::size_t>(std::count(medium.inside.begin(), medium.inside.end(), 1));
    return medium;
  }
  medium.count = 0;
  std::size_t voxel = 0;
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j)
      for (int i = 0; i < g.nx - 1; ++i) {
        bool any = false;
        for (int c = 0; c < 8; ++c) any = any || holds(g.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)));
        medium.inside[voxel++] = any ? 1 : 0;
        medium.count += any ? 1 : 0;
      }
  return medium;
}

Status relight(ShownVolume& shown, Light light, const ComputeOptions& compute) {
  using Source = Light::Source;
  const Light& filmed = shown.lighting.light;
  if (filmed.source == Source::none)
    return Error{ErrorKind::bad_input, "wasn't reconstructed as lit from outside", "light",
                 "Only the light of such a result can be replaced (--effects light=...)"};
  if (shown.volume.extinction.empty())
    return Error{ErrorKind::bad_input, "has no extinction that light could fall on", "light"};
  if (light.source == Source::found)
    return Error{ErrorKind::bad_input, "a light to be found needs pictures", "light",
                 "Give none, even, distant or nearby"};
  const Grid& grid = shown.volume.grid;
  const Box box = box_of(grid);
  constexpr double kHalf = 0.5 * (1 + 1e-5);  // the grid's places are rounded
  if (light.source == Source::nearby &&
      (from_middle(light, box).array().abs() <= kHalf * box.size.array()).all())
    return Error{ErrorKind::bad_input, "the nearby light stands inside of the box around the medium", "light",
                 "Give a place outside of it"};
  light.ambient = light.strength = {};
  for (std::size_t c = 0; c < 3; ++c) {
    const double unshaded = filmed.ambient[c] + filmed.strength[c] / spread_in_the_middle(filmed, grid);
    if (light.source == Source::even) light.ambient[c] = unshaded;
    if (light.source == Source::distant || light.source == Source::nearby)
      light.strength[c] = spread_in_the_middle(light, grid) * unshaded;
  }
  Pool pool(compute.threads);
  shown.volume.emission = lit_emission(shown.volume, light, pool);
  shown.lighting.light = light;
  return {};
}

LightViews::LightViews(Volume volume, const Scattering& scattering, const ComputeOptions& compute)
    : volume_(std::move(volume)),
      dark_{volume_.grid, {}, volume_.extinction},
      effects_(absorption_of(volume_)),
      compute_(compute),
      medium_(medium_of(volume_)) {
  if (dark_.extinction.empty()) return;
  dark_.emission.resize(volume_.emission.size());
  if (scattering.order == Scattering::Order::none || scattering.albedo <= 0) return;
  effects_.scattering = scattering;
  medium_ = filled_voxels(volume_);
  Pool pool(compute_);
  scattered_ = find_in_scatter(volume_, medium_, effects_, {}, pool);
}

std::vector<ShownView> LightViews::of(const std::vector<const CameraModel*>& cameras) const {
  std::vector<ShownView> views;
  RenderOptions options;
  options.compute = compute_;
  options.scattered = &scattered_;
  for (RadianceImage& light : rendered(volume_, medium_, effects_, cameras, options)) {
    std::vector<float> opacity(light.rgb.size() / 3);
    views.push_back({std::move(light), std::move(opacity)});
  }
  if (dark_.extinction.empty()) return views;
  Effects before_white = absorption_of(dark_);
  before_white.background = {Background::Kind::constant, {kWhite, kWhite, kWhite}};
  const std::vector<RadianceImage> through = rendered(dark_, medium_, before_white, cameras, options);
  for (std::size_t v = 0; v < views.size(); ++v)
    for (std::size_t i = 0; i < views[v].opacity.size(); ++i)
      views[v].opacity[i] = std::clamp(1 - through[v].rgb[3 * i] / kWhite, 0.0F, 1.0F);
  return views;
}

TemperatureViews::TemperatureViews(const ShownVolume& shown, const ComputeOptions& compute)
    : weighted_{shown.volume.grid, std::vector<float>(shown.volume.emission.size()), shown.volume.extinction,
                shown.volume.inside},
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
  for (const RadianceImage& sum : weighted_sums(weighted_, cameras, compute_)) {
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
    for (const RadianceImage& sum : weighted_sums(weighted_, these, compute_))
      for (std::size_t i = 1; i < sum.rgb.size(); i += 3) brightest = std::max(brightest, sum.rgb[i]);
  }
  return kShare * brightest;
}

}  // namespace emberlock::recon
