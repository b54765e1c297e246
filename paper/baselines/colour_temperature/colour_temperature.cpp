// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/colour_temperature/colour_temperature.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Core>

#include "recon/hull/hull.h"
#include "recon/views/flame_mask.h"

namespace emberlock::paper {
namespace {

constexpr double kLeastSquare = 0.17;  // sine of 10 degrees: more parallel views don't fix a place
constexpr std::size_t kRatios = 1024;

/// 1 / T of an entry of the table of ratios.
double inverse_kelvin(double entry) {
  const double share = entry / (kRatios - 1);
  return (1 - share) / recon::EmitterTable::kColdest + share / recon::EmitterTable::kHottest;
}

/// What a colour view says of a slice, ray by ray.
struct Rays {
  std::vector<double> light;   ///< of the three channels together, grey levels
  std::vector<double> kelvin;  ///< 0 where a ray is dark
  double total = 0;            ///< light of all rays
  double mean_kelvin = 0;      ///< by light
};

Rays rays_of(const ParallelSlices& slices, const ParallelPicture& picture, int k, const TwoColours& colours,
             double threshold) {
  const float* rgb = picture.light.data() + static_cast<std::size_t>(k) * slices.profile();
  Rays rays;
  double told = 0;
  for (int b = 0; b < slices.offsets; ++b, rgb += 3) {
    const auto red = static_cast<double>(rgb[0]);
    const auto green = static_cast<double>(rgb[1]);
    const double light = red + green + static_cast<double>(rgb[2]);
    const bool tells = std::max(red, green) > threshold && std::min(red, green) > 0;
    rays.light.push_back(light);
    rays.kelvin.push_back(tells ? colours.temperature(red, green).value() : 0);
    rays.total += light;
    told += tells ? light : 0;
    rays.mean_kelvin += rays.kelvin.back() * light;
  }
  if (told > 0) rays.mean_kelvin /= told;
  return rays;
}

double between(const std::vector<double>& values, double ray) {
  const double before = std::floor(ray);
  const auto at = static_cast<std::size_t>(before);
  return values[at] + (ray - before) * (values[at + 1] - values[at]);
}

/// The mean of the two rays' that have a temperature; 0 where none has.
double kelvin_between(const std::vector<double>& kelvin, double ray) {
  const double before = std::floor(ray);
  const auto at = static_cast<std::size_t>(before);
  if (kelvin[at] <= 0) return kelvin[at + 1];
  if (kelvin[at + 1] <= 0) return kelvin[at];
  return kelvin[at] + (ray - before) * (kelvin[at + 1] - kelvin[at]);
}

/// Reconstructs slices from two colour views, inside a hull.
class ColourSlices {
 public:
  ColourSlices(const ParallelSlices& slices, const recon::Hull& hull, const TwoColours& colours,
               std::array<const ParallelPicture*, 2> pictures, std::array<double, 2> thresholds)
      : slices_(slices),
        hull_(hull),
        colours_(colours),
        pictures_(pictures),
        thresholds_(thresholds),
        projectors_{ParallelProjector(slices, pictures[0]->across),
                    ParallelProjector(slices, pictures[1]->across)} {}

  /// A layer's emission and temperatures.
  void reconstruct(int k, float* layer, float* kelvin) const {
    const std::array<Rays, 2> rays = {rays_of(slices_, *pictures_[0], k, colours_, thresholds_[0]),
                                      rays_of(slices_, *pictures_[1], k, colours_, thresholds_[1])};
    const double total = (rays[0].total + rays[1].total) / 2;
    const double mean_kelvin = (rays[0].mean_kelvin + rays[1].mean_kelvin) / 2;
    if (rays[0].total <= 0 || rays[1].total <= 0 || mean_kelvin <= 0) return;
    const double gain =
        crossing(*pictures_[0], *pictures_[1]) / (total * static_cast<double>(slices_.grid.edge));
    std::vector<std::uint32_t> points;
    std::size_t at = 0;
    for (int j = 0; j < slices_.grid.ny; ++j)
      for (int i = 0; i < slices_.grid.nx; ++i, ++at) {
        const double light = between(rays[0].light, ray(0, i, j)) * between(rays[1].light, ray(1, i, j));
        const double first = kelvin_between(rays[0].kelvin, ray(0, i, j));
        const double second = kelvin_between(rays[1].kelvin, ray(1, i, j));
        if (light <= 0 || first + second <= 0 || !in_hull(i, j, k)) continue;
        points.push_back(static_cast<std::uint32_t>(at));
        const double product = first > 0 && second > 0 ? first * second / mean_kelvin : first + second;
        kelvin[at] = static_cast<float>(
            std::clamp(product, recon::EmitterTable::kColdest, recon::EmitterTable::kHottest));
        const std::array<double, 3> colour = colours_.colour(Kelvin(static_cast<double>(kelvin[at])));
        for (std::size_t c = 0; c < 3; ++c) layer[3 * at + c] = static_cast<float>(gain * light * colour[c]);
      }
    for (std::size_t v = 0; v < 2; ++v) scale_rays(v, rays[v].light, points, layer);
  }

 private:
  /// The ray that passes a key point, counted from the left.
  [[nodiscard]] double ray(std::size_t view, int i, int j) const {
    const int middle = slices_.offsets / 2;
    return pictures_[view]->across.dot(slices_.place(i, j)) / static_cast<double>(slices_.grid.edge) + middle;
  }

  /// Whether one of the eight voxels around a key point is.
  [[nodiscard]] bool in_hull(int i, int j, int k) const {
    const recon::Grid& grid = slices_.grid;
    for (int corner = 0; corner < 8; ++corner) {
      const int x = i - (corner & 1);
      const int y = j - (corner >> 1 & 1);
      const int z = k - (corner >> 2);
      if (x < 0 || y < 0 || z < 0 || x >= grid.nx - 1 || y >= grid.ny - 1 || z >= grid.nz - 1) continue;
      const std::size_t voxel = static_cast<std::size_t>(x) +
                                static_cast<std::size_t>(grid.nx - 1) *
                                    (static_cast<std::size_t>(y) +
                                     static_cast<std::size_t>(grid.ny - 1) * static_cast<std::size_t>(z));
      if (hull_.inside[voxel] != 0) return true;
    }
    return false;
  }

  /// Gives the rays of a view the light that its picture has, where they have any: what the hull cut away.
  void scale_rays(std::size_t view, const std::vector<double>& light,
                  const std::vector<std::uint32_t>& points, float* layer) const {
    std::vector<float> profile(slices_.profile());
    projectors_[view].project(layer, points, profile.data());
    std::vector<double> gains;
    for (std::size_t b = 0; b < light.size(); ++b) {
      const double shown = static_cast<double>(profile[3 * b]) + static_cast<double>(profile[3 * b + 1]) +
                           static_cast<double>(profile[3 * b + 2]);
      gains.push_back(shown > 0 ? std::min(light[b] / shown, kMostGain) : 0);
    }
    for (const std::size_t at : points) {
      const auto row = static_cast<std::size_t>(slices_.grid.nx);
      const auto gain = static_cast<float>(
          between(gains, ray(view, static_cast<int>(at % row), static_cast<int>(at / row))));
      for (std::size_t c = 0; c < 3; ++c) layer[3 * at + c] *= gain;
    }
  }

  static constexpr double kMostGain = 10;  // a ray of which the hull left next to nothing stays dim

  const ParallelSlices& slices_;
  const recon::Hull& hull_;
  const TwoColours& colours_;
  std::array<const ParallelPicture*, 2> pictures_;
  std::array<double, 2> thresholds_;
  std::array<ParallelProjector, 2> projectors_;
};

/// The scene with these of its input views only.
recon::Scene only(const recon::Scene& scene, const std::vector<std::size_t>& inputs) {
  recon::Scene out = scene;
  out.views.clear();
  std::vector<const recon::View*> all;
  for (const recon::View& view : scene.views)
    if (view.role == recon::ViewRole::input) all.push_back(&view);
  for (const std::size_t n : inputs) out.views.push_back(*all[n]);
  return out;
}

}  // namespace

Result<TwoColours> TwoColours::create(const recon::CameraResponse& response, recon::Emitter emitter) {
  TwoColours colours(recon::EmitterTable(response, emitter));
  for (std::size_t n = 0; n < kRatios; ++n) {
    const std::array<double, 3> rgb = colours.colour(Kelvin(1 / inverse_kelvin(static_cast<double>(n))));
    const double ratio = rgb[0] > 0 ? rgb[1] / rgb[0] : 0;
    if (rgb[0] <= 0 || (n > 0 && ratio < colours.ratio_.back()) || (n + 1 == kRatios && ratio <= 0))
      return Error{ErrorKind::bad_input, "green over red of a black body doesn't rise with its temperature",
                   "response", "Give the response of a camera with a red and a green channel"};
    colours.ratio_.push_back(ratio);
  }
  return colours;
}

Kelvin TwoColours::temperature(double red, double green) const {
  const double ratio = green / red;
  const auto above = std::upper_bound(ratio_.begin(), ratio_.end(), ratio);
  if (above == ratio_.begin()) return Kelvin(recon::EmitterTable::kColdest);
  if (above == ratio_.end()) return Kelvin(recon::EmitterTable::kHottest);
  const double below = *(above - 1);
  const double part = (ratio - below) / (*above - below);
  return Kelvin(1 / inverse_kelvin(static_cast<double>(above - ratio_.begin() - 1) + part));
}

std::array<double, 3> TwoColours::colour(Kelvin temperature) const { return table_.at(temperature).value; }

std::vector<std::size_t> four_views(const std::vector<ParallelPicture>& pictures) {
  std::vector<std::size_t> views = {0, 0};
  double most = 0;
  for (std::size_t a = 0; a < pictures.size(); ++a)
    for (std::size_t b = a + 1; b < pictures.size(); ++b)
      if (crossing(pictures[a], pictures[b]) > most + 1e-9) {
        most = crossing(pictures[a], pictures[b]);
        views = {a, b};
      }
  const Eigen::Vector2d first = pictures[views[0]].across;
  const Eigen::Vector2d second = pictures[views[1]].across;
  for (const Eigen::Vector2d& bisector : {Eigen::Vector2d(first + second), Eigen::Vector2d(first - second)}) {
    std::size_t nearest = pictures.size();
    for (std::size_t n = 0; n < pictures.size(); ++n) {
      if (std::find(views.begin(), views.end(), n) != views.end()) continue;
      const auto along = [&](std::size_t v) { return std::abs(pictures[v].across.dot(bisector)); };
      if (nearest == pictures.size() || along(n) > along(nearest) + 1e-9) nearest = n;
    }
    if (nearest < pictures.size()) views.push_back(nearest);
  }
  return views;
}

Result<MethodResult> colour_temperature(const recon::Scene& scene, const MethodOptions& options) {
  EMBERLOCK_RETURN_IF_ERROR(check_method(scene, options));
  const ParallelSlices slices = slices_over(recon::grid_over(scene.box, options.voxels));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<ParallelPicture> pictures, parallel_pictures(scene, slices));
  const std::vector<std::size_t> views = four_views(pictures);
  const ParallelPicture& first = pictures[views[0]];
  const ParallelPicture& second = pictures[views[1]];
  if (crossing(first, second) < kLeastSquare)
    return Error{ErrorKind::bad_input, "no two input views see the flame from different sides", "scene",
                 "Add a view, best at a right angle to another"};
  const recon::CameraResponse& response = options.response ? *options.response
                                          : scene.response ? *scene.response
                                                           : recon::standard_response();
  EMBERLOCK_ASSIGN_OR_RETURN(const TwoColours colours, TwoColours::create(response, options.emitter));
  const recon::Scene four = only(scene, views);
  const recon::ComputeOptions on_cpu{recon::Device::cpu, options.compute.threads};
  const std::vector<recon::FlameMask> masks = recon::flame_masks(four, std::nullopt, on_cpu);
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Hull hull, recon::carve(four, masks, slices.grid, on_cpu));
  recon::Volume volume{slices.grid, std::vector<float>(3 * slices.grid.size()), {}};
  std::vector<float> kelvin(slices.grid.size());
  const ColourSlices reconstruct(slices, hull, colours, {&first, &second},
                                 {masks[0].threshold, masks[1].threshold});
  each_layer(slices, options, [&](int k) {
    const auto layer = static_cast<std::size_t>(k) * slices.layer();
    reconstruct.reconstruct(k, volume.emission.data() + layer, kelvin.data() + layer / 3);
  });
  EMBERLOCK_ASSIGN_OR_RETURN(MethodResult result, checked_result(scene, std::move(volume), options));
  result.kelvin = std::move(kelvin);
  return result;
}

}  // namespace emberlock::paper
