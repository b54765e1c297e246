// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/parallel_slices.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "recon/adjust/picture_error.h"
#include "recon/compute/pool.h"
#include "recon/render/render.h"
#include "recon/views/check_scene.h"
#include "recon/views/flame_mask.h"

namespace emberlock::paper {
namespace {

constexpr int kMostSamples = 8;    // along each side of the square that a ray's value is the mean of
constexpr int kLayersAtOnce = 16;  // between two looks at `stop`

/// Bilinear between pixel centres; dark beyond the picture.
Eigen::Vector3d colour_at(const recon::RadianceImage& image, const Eigen::Vector2d& pixel) {
  const double left = std::floor(pixel.x() - 0.5);
  const double top = std::floor(pixel.y() - 0.5);
  if (!(left >= -1 && top >= -1 && left < image.size.width && top < image.size.height))
    return Eigen::Vector3d::Zero();
  const double right_part = pixel.x() - 0.5 - left;
  const double lower_part = pixel.y() - 0.5 - top;
  Eigen::Vector3d colour = Eigen::Vector3d::Zero();
  for (int corner = 0; corner < 4; ++corner) {
    const int x = static_cast<int>(left) + (corner & 1);
    const int y = static_cast<int>(top) + (corner >> 1);
    if (x < 0 || y < 0 || x >= image.size.width || y >= image.size.height) continue;
    const double weight = ((corner & 1) != 0 ? right_part : 1 - right_part) *
                          ((corner >> 1) != 0 ? lower_part : 1 - lower_part);
    const std::size_t at = 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.size.width) +
                                static_cast<std::size_t>(x));
    for (int c = 0; c < 3; ++c)
      colour[c] += weight * static_cast<double>(image.rgb[at + static_cast<std::size_t>(c)]);
  }
  return colour;
}

recon::RadianceImage flame_alone(recon::RadianceImage image) {
  const recon::FlameMask mask = recon::noise_mask(image);
  for (std::size_t p = 0; p < mask.flame.size(); ++p)
    if (mask.flame[p] == 0) std::fill_n(image.rgb.begin() + static_cast<std::ptrdiff_t>(3 * p), 3, 0.F);
  return image;
}

/// The mean of the picture over a square of one voxel edge in the plane through the axis.
Eigen::Vector3d mean_around(const recon::CameraModel& camera, const recon::RadianceImage& image,
                            const Eigen::Vector3d& middle, const Eigen::Vector3d& across, double edge,
                            int samples) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int y = 0; y < samples; ++y)
    for (int x = 0; x < samples; ++x) {
      const Eigen::Vector3d point = middle + edge * ((x + 0.5) / samples - 0.5) * across +
                                    edge * ((y + 0.5) / samples - 0.5) * Eigen::Vector3d::UnitZ();
      if ((camera.camera_from_world * point).z() > 1e-6) sum += colour_at(image, camera.project(point));
    }
  return sum / (samples * samples);
}

void resample(const recon::View& view, const ParallelSlices& slices, ParallelPicture& picture) {
  const recon::Grid& grid = slices.grid;
  const Eigen::Vector3d across(picture.across.x(), picture.across.y(), 0);
  const double edge = static_cast<double>(grid.edge);
  const Eigen::Vector3d middle(slices.axis.x(), slices.axis.y(),
                               static_cast<double>(grid.origin[2]) + edge * (grid.nz - 1) / 2);
  const double pixels = view.camera.intrinsics.fx * edge / (view.camera.center() - middle).norm();
  const int samples = static_cast<int>(std::clamp(std::ceil(pixels), 1.0, double{kMostSamples}));
  const recon::RadianceImage flame = flame_alone(*view.image);
  picture.light.resize(slices.profile() * static_cast<std::size_t>(grid.nz));
  const int middle_offset = slices.offsets / 2;
  for (int k = 0; k < grid.nz; ++k)
    for (int b = 0; b < slices.offsets; ++b) {
      const double offset = edge * (b - middle_offset);
      const Eigen::Vector3d at =
          middle + offset * across + edge * (k - (grid.nz - 1) / 2.0) * Eigen::Vector3d::UnitZ();
      const Eigen::Vector3d colour = mean_around(view.camera, flame, at, across, edge, samples);
      float* const to = picture.light.data() + static_cast<std::size_t>(k) * slices.profile() +
                        3 * static_cast<std::size_t>(b);
      for (int c = 0; c < 3; ++c) to[c] = static_cast<float>(std::max(0.0, colour[c]));
    }
}

recon::Hull glowing_voxels(const recon::Volume& volume) {
  const recon::Grid& grid = volume.grid;
  recon::Hull hull = recon::whole_grid(grid);
  hull.count = 0;
  std::size_t voxel = 0;
  for (int k = 0; k < grid.nz - 1; ++k)
    for (int j = 0; j < grid.ny - 1; ++j)
      for (int i = 0; i < grid.nx - 1; ++i) {
        bool glows = false;
        for (int corner = 0; corner < 8 && !glows; ++corner) {
          const float* rgb =
              &volume.emission[3 * grid.index(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2))];
          glows = rgb[0] > 0 || rgb[1] > 0 || rgb[2] > 0;
        }
        hull.inside[voxel++] = glows ? 1 : 0;
        hull.count += glows ? 1 : 0;
      }
  return hull;
}

}  // namespace

std::size_t ParallelSlices::layer() const {
  return 3 * static_cast<std::size_t>(grid.nx) * static_cast<std::size_t>(grid.ny);
}

std::size_t ParallelSlices::profile() const { return 3 * static_cast<std::size_t>(offsets); }

Eigen::Vector2d ParallelSlices::place(int i, int j) const {
  return static_cast<double>(grid.edge) * Eigen::Vector2d(i - (grid.nx - 1) / 2.0, j - (grid.ny - 1) / 2.0);
}

ParallelSlices slices_over(const recon::Grid& grid) {
  ParallelSlices slices;
  slices.grid = grid;
  const double edge = static_cast<double>(grid.edge);
  slices.axis = Eigen::Vector2d(static_cast<double>(grid.origin[0]) + edge * (grid.nx - 1) / 2,
                                static_cast<double>(grid.origin[1]) + edge * (grid.ny - 1) / 2);
  // One more on each side, so that a key point always lies between two rays.
  slices.offsets = 2 * static_cast<int>(std::ceil(std::hypot(grid.nx - 1, grid.ny - 1) / 2) + 1) + 1;
  return slices;
}

Result<std::vector<ParallelPicture>> parallel_pictures(const recon::Scene& scene,
                                                       const ParallelSlices& slices) {
  std::vector<ParallelPicture> pictures;
  for (const recon::View& view : scene.views) {
    if (view.role != recon::ViewRole::input) continue;
    const Eigen::Vector2d ahead = slices.axis - view.camera.center().head<2>();
    if (ahead.norm() < static_cast<double>(slices.grid.edge))
      return Error{ErrorKind::bad_input, "the camera stands above or below the flame", view.name,
                   "This method takes cameras that stand around it; leave this view out"};
    ParallelPicture picture;
    picture.across = Eigen::Vector2d(ahead.y(), -ahead.x()).normalized();
    resample(view, slices, picture);
    pictures.push_back(std::move(picture));
  }
  if (pictures.empty())
    return Error{ErrorKind::bad_input, "no view is an input", "scene", "Give it one at least"};
  return pictures;
}

ParallelProjector::ParallelProjector(const ParallelSlices& slices, const Eigen::Vector2d& across)
    : profile_(slices.profile()), edge_(slices.grid.edge) {
  const int middle = slices.offsets / 2;
  for (int j = 0; j < slices.grid.ny; ++j)
    for (int i = 0; i < slices.grid.nx; ++i) {
      const double ray = across.dot(slices.place(i, j)) / static_cast<double>(edge_) + middle;
      const double before = std::floor(ray);
      between_.push_back({static_cast<std::int32_t>(before), static_cast<float>(ray - before)});
    }
}

void ParallelProjector::project(const float* layer, std::span<const std::uint32_t> points,
                                float* profile) const {
  std::fill(profile, profile + profile_, 0.F);
  for (const std::size_t p : points) {
    // A tent holds edge^2 of its value, and a ray stands for a strip one edge wide.
    float* const to = profile + 3 * between_[p].ray;
    for (std::size_t c = 0; c < 3; ++c) {
      const float light = edge_ * layer[3 * p + c];
      to[c] += (1 - between_[p].next) * light;
      to[c + 3] += between_[p].next * light;
    }
  }
}

void ParallelProjector::back_project(const float* profile, std::span<const std::uint32_t> points,
                                     float* layer) const {
  for (const std::size_t p : points) {
    const float* const from = profile + 3 * between_[p].ray;
    for (std::size_t c = 0; c < 3; ++c)
      layer[3 * p + c] += edge_ * ((1 - between_[p].next) * from[c] + between_[p].next * from[c + 3]);
  }
}

void each_layer(const ParallelSlices& slices, const MethodOptions& options,
                const std::function<void(int k)>& work) {
  const int layers = slices.grid.nz;
  recon::Pool pool(options.compute.threads);
  for (int first = 0; first < layers && !(options.stop && options.stop()); first += kLayersAtOnce)
    pool.run(std::min(kLayersAtOnce, layers - first), [&](int n) { work(first + n); });
}

double crossing(const ParallelPicture& a, const ParallelPicture& b) {
  return std::abs(a.across.x() * b.across.y() - a.across.y() * b.across.x());
}

Result<MethodResult> checked_result(const recon::Scene& scene, recon::Volume volume,
                                    const MethodOptions& options) {
  if (!std::all_of(volume.emission.begin(), volume.emission.end(), [](float v) { return std::isfinite(v); }))
    return Error{ErrorKind::not_converged, "the volume isn't finite", "scene",
                 "Scale its pictures to 0..255"};
  recon::Hull medium = glowing_voxels(volume);
  MethodResult result{std::move(volume), std::move(medium), recon::Effects{}};
  recon::RenderOptions march;
  march.compute = {recon::Device::cpu, options.compute.threads};
  double error = 0;
  double darkness = 0;
  for (const recon::View& view : scene.views) {
    if (view.role != recon::ViewRole::input) continue;
    const recon::RadianceImage shown =
        recon::render_view(result.volume, result.medium, result.effects, view.camera, march);
    const double miss = recon::all_channels(recon::rmse(view, shown, {}));
    const double dark = recon::all_channels(recon::rmse(view, recon::RadianceImage(view.image->size), {}));
    error += miss * miss;
    darkness += dark * dark;
  }
  if (error > darkness)
    return Error{ErrorKind::not_converged, "the volume shows the input views worse than darkness does",
                 "scene", "Check the cameras' calibration"};
  return result;
}

Status check_method(const recon::Scene& scene, const MethodOptions& options) {
  if (options.voxels < 8 || options.voxels > 256)
    return Error{ErrorKind::bad_input, fmt::format("{} voxels aren't 8..256", options.voxels), "voxels",
                 "Give 8..256"};
  return recon::check_scene(scene);
}

}  // namespace emberlock::paper
