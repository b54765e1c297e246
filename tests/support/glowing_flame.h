// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/random.h"
#include "recon/render/render.h"
#include "recon/synthetic/flame.h"
#include "recon/temperature/self_absorption.h"
#include "recon/temperature/temperature.h"
#include "tests/support/spectral_camera.h"

namespace emberlock::test {

/// A camera with three overlapping lobes.
inline recon::CameraResponse lobes(double scale = 1, std::array<double, 3> nm = {600, 540, 460},
                                   std::array<double, 3> sigma = {40, 40, 30}) {
  recon::CameraResponse response;
  response.absolute = true;
  for (double w = 380; w <= 780; w += 5) {
    response.wavelength_nm.push_back(w);
    for (std::size_t c = 0; c < 3; ++c)
      response.level[c].push_back(scale * std::exp(-0.5 * std::pow((w - nm[c]) / sigma[c], 2)));
  }
  return response;
}

/// A camera that shows red : green : blue as 1 : 1/2 : 1/3, as the ball of the command line's tests does, at
/// 1800 K.
inline recon::CameraResponse response_of_the_ball() {
  recon::CameraResponse response = lobes();
  response.absolute = false;
  const recon::EmitterLevels shown = recon::levels_of(response, recon::Emitter::grey, Kelvin(1800));
  for (std::size_t c = 0; c < 3; ++c)
    for (double& v : response.level[c]) v /= shown.value[c] * static_cast<double>(c + 1);
  return response;
}

struct GlowingFlameOptions {
  recon::PaperSceneOptions film = {};
  double coldest = 1450, hottest = 2030;  // K
  recon::Emitter emitter = recon::Emitter::grey;
  double noise = 0.25;    // grey levels
  double levels = 65535;  // of the camera's samples; 0: neither rounded nor cut at black
  bool spectral = false;  // filmed by SpectralCamera, of soot alone
  double sodium = 0;      // share of the light where x > 0
  double blue_base = 0;   // share of the height below which C2 shines and no soot is
};

/// A drawn flame whose absorption is its soot's, cooler where there is more of it and further up.
class GlowingFlame {
 public:
  explicit GlowingFlame(const GlowingFlameOptions& options)
      : options_(options), flame_(with_soot(options.film.flame)), response_(lobes()) {
    scale();
  }
  [[nodiscard]] const recon::CameraResponse& response() const { return response_; }
  [[nodiscard]] const GlowingFlameOptions& options() const { return options_; }

  [[nodiscard]] Glowing at(const recon::Grid& grid) const {
    const recon::FlameTruth truth = flame_.at(Seconds(0), grid);
    Glowing out{grid, {}, truth.volume.extinction};
    out.kelvin.resize(grid.size());
    const double height = options_.film.flame.height.value();
    const double thick = 2.5 * options_.film.flame.extinction.value();
    for (int k = 0; k < grid.nz; ++k) {
      const double up = std::clamp(
          (static_cast<double>(grid.origin[2]) + k * static_cast<double>(grid.edge)) / height + 0.5, 0.0,
          1.0);
      for (int j = 0; j < grid.ny; ++j)
        for (int i = 0; i < grid.nx; ++i) {
          const std::size_t p = grid.index(i, j, k);
          const double dense = std::min(1.0, static_cast<double>(out.absorption[p]) / thick);
          if (up < options_.blue_base) out.absorption[p] = 0;
          out.kelvin[p] = static_cast<float>(options_.hottest - (options_.hottest - options_.coldest) *
                                                                    (0.55 * dense + 0.45 * up));
        }
    }
    return out;
  }

  /// In levels a metre.
  [[nodiscard]] recon::FlameTruth lit(const recon::Grid& grid) const {
    recon::FlameTruth truth = flame_.at(Seconds(0), grid);
    const Glowing glowing = at(grid);
    const recon::EmitterTable table(response_, options_.emitter, Kelvin(1000), Kelvin(2500));
    const recon::EmitterLevels base = table.at(Kelvin((options_.coldest + options_.hottest) / 2));
    const std::array<double, 3> sodium = shown("sodium");
    const std::array<double, 3> c2 = shown("c2");
    for (std::size_t p = 0; p < grid.size(); ++p) {
      const recon::EmitterLevels levels = table.at(Kelvin(static_cast<double>(glowing.kelvin[p])));
      const double soot = static_cast<double>(glowing.absorption[p]) * std::exp(levels.log_scale);
      const double salt = right_of_middle(grid, p) ? options_.sodium / (1 - options_.sodium) * soot : 0;
      // As bright as soot of the middle of the temperatures would be.
      const double gas =
          static_cast<double>(truth.volume.extinction[p] - glowing.absorption[p]) * std::exp(base.log_scale);
      for (std::size_t c = 0; c < 3; ++c)
        truth.volume.emission[3 * p + c] =
            static_cast<float>(soot * levels.value[c] + salt * sodium[c] + gas * c2[c]);
    }
    truth.volume.extinction = glowing.absorption;
    return truth;
  }

  /// The paper's set-up; the last view is held out.
  [[nodiscard]] recon::Scene film() const {
    recon::PaperSceneOptions film = options_.film;
    film.truth_voxels = 2;
    recon::Scene scene = recon::paper_scene(film);
    std::vector<recon::RadianceImage> seen = options_.spectral ? by_wavelengths(scene) : by_channels(scene);
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
      recon::RadianceImage& image = seen[v];
      for (std::size_t i = 0; i < image.rgb.size(); ++i) {
        double level = static_cast<double>(image.rgb[i]) +
                       options_.noise * random_normal(options_.film.flame.seed, v, i);
        if (options_.levels > 0) level = std::round(level * options_.levels / 255) * 255 / options_.levels;
        image.rgb[i] =
            static_cast<float>(std::min(options_.levels > 0 ? std::max(level, 0.0) : level, 255.0));
      }
      scene.views[v].image = recon::share(std::move(image));
    }
    return scene;
  }

  /// Before noise: soot absorbs each channel's light differently.
  [[nodiscard]] std::vector<recon::RadianceImage> by_channels(const recon::Scene& scene) const {
    const recon::FlameTruth truth = lit(recon::grid_over(scene.box, options_.film.truth_voxels));
    recon::RenderOptions march;
    march.step = options_.film.truth_step;
    const auto shares = recon::channel_absorption(response_, options_.emitter, Kelvin(1800));
    std::vector<recon::RadianceImage> seen;
    for (const recon::View& view : scene.views) seen.emplace_back(view.camera.intrinsics.size);
    for (std::size_t c = 0; c < 3; ++c) {
      recon::FlameTruth absorbed = truth;
      for (float& e : absorbed.volume.extinction) e *= static_cast<float>(shares[c]);
      for (std::size_t v = 0; v < seen.size(); ++v) {
        const recon::RadianceImage own =
            recon::render_view(absorbed.volume, truth.medium, truth.effects, scene.views[v].camera, march);
        for (std::size_t i = c; i < own.rgb.size(); i += 3) seen[v].rgb[i] = own.rgb[i];
      }
    }
    return seen;
  }
  [[nodiscard]] std::vector<recon::RadianceImage> by_wavelengths(const recon::Scene& scene) const {
    const Glowing gas = at(recon::grid_over(scene.box, options_.film.truth_voxels));
    const SpectralCamera camera(gas, options_.emitter, response_);
    std::vector<recon::RadianceImage> seen;
    for (const recon::View& view : scene.views) seen.push_back(camera.picture(view.camera));
    return seen;
  }

  /// Where sodium is, if there is any.
  static bool right_of_middle(const recon::Grid& grid, std::size_t p) {
    const auto i = static_cast<float>(p % static_cast<std::size_t>(grid.nx));
    return grid.origin[0] + grid.edge * i > 0;
  }

 private:
  /// A line emitter's channels, which add up to 1.
  [[nodiscard]] std::array<double, 3> shown(std::string_view line) const {
    std::array<double, 3> out = recon::levels_of(response_, *recon::parse_lines(line)->named.front());
    const double sum = out[0] + out[1] + out[2];
    for (double& v : out) v /= sum;
    return out;
  }
  static recon::FlameOptions with_soot(recon::FlameOptions options) {
    options.absorber = recon::Absorber::soot;
    return options;
  }
  /// So that the brightest pixel from the side is about 230.
  void scale() {
    recon::PaperSceneOptions film = options_.film;
    film.truth_voxels = 2;
    film.image = {80, 60};
    const recon::Scene scene = recon::paper_scene(film);
    const recon::FlameTruth truth = lit(recon::grid_over(scene.box, 64));
    float most = 0;
    for (std::size_t v = 0; v < 2; ++v)
      for (const float level :
           recon::render_view(truth.volume, truth.medium, truth.effects, scene.views[v].camera).rgb)
        most = std::max(most, level);
    response_ = lobes(230 / static_cast<double>(most));
  }

  GlowingFlameOptions options_;
  recon::Flame flame_;
  recon::CameraResponse response_;
};

/// Errors of a field against the truth, over key points with soot whose true emission is 5 % of the
/// brightest, weighted by it.
struct TemperatureScore {
  double median = 0, most = 0, bias = 0;  // K; `most`: 95 % lie below
  double within = 0;                      // share within two sigma
  double told = 0;                        // share of the points
  double rows = 1;
  void add(const TemperatureScore& o) {
    if (rows == 1 && told == 0) rows = 0;
    median += o.median, most += o.most, bias += o.bias, within += o.within, told += o.told, rows += 1;
  }
  [[nodiscard]] TemperatureScore mean() const {
    return {median / rows, most / rows, bias / rows, within / rows, told / rows};
  }
};

/// The same under effects that allow no joint solve: each voxel's temperature is read by itself.
inline recon::Reconstruction voxel_by_voxel(recon::Reconstruction done) {
  done.effects.exposure.shutter = recon::Exposure::Shutter::integrated;
  return done;
}

/// What a reconstruction should find at its key points: K, 1/m, and levels of three channels.
struct GlowTruth {
  std::vector<float> kelvin, absorption, emission;
};

inline TemperatureScore score_of(const GlowTruth& truth, const recon::Reconstruction& done,
                                 const recon::TemperatureField& field) {
  const recon::Grid& grid = done.volume.grid;
  const std::vector<float>& lit = truth.emission;
  const float brightest = *std::max_element(lit.begin(), lit.end());
  struct Off {
    double kelvin, sigma, weight;
  };
  std::vector<Off> off;
  std::size_t emitting = 0;
  double weights = 0;
  TemperatureScore score;
  for (std::size_t p = 0; p < grid.size(); ++p) {
    const float own = std::max({lit[3 * p], lit[3 * p + 1], lit[3 * p + 2]});
    if (own < 0.05F * brightest || !(truth.absorption[p] > 0)) continue;
    ++emitting;
    if (!(field.kelvin[p] > 0)) continue;
    const double error = static_cast<double>(field.kelvin[p] - truth.kelvin[p]);
    off.push_back({std::abs(error), static_cast<double>(field.sigma[p]), static_cast<double>(own)});
    weights += off.back().weight;
    score.bias += off.back().weight * error;
    if (off.back().kelvin < 2 * off.back().sigma) score.within += off.back().weight;
  }
  if (off.empty()) return score;
  score.bias /= weights;
  score.within /= weights;
  score.told = static_cast<double>(off.size()) / static_cast<double>(emitting);
  std::sort(off.begin(), off.end(), [](const Off& a, const Off& b) { return a.kelvin < b.kelvin; });
  double sum = 0;
  for (const Off& o : off) {
    sum += o.weight;
    if (sum <= 0.5 * weights) score.median = o.kelvin;
    if (sum <= 0.95 * weights) score.most = o.kelvin;
  }
  return score;
}

inline TemperatureScore score_of(const GlowingFlame& flame, const recon::Reconstruction& done,
                                 const recon::TemperatureField& field) {
  const recon::Grid& grid = done.volume.grid;
  const Glowing glowing = flame.at(grid);
  return score_of({glowing.kelvin, glowing.absorption, flame.lit(grid).volume.emission}, done, field);
}

inline std::string words(const TemperatureScore& score, const recon::TemperatureField& field) {
  return fmt::format(
      "median {:.1f} K, 95 % {:.1f}, bias {:+.1f}, within two sigma {:.1f} %, told {:.1f} %; {:.0f} K on "
      "average, "
      "sigma {:.1f}, if the other kind {:.0f}; chi-square {:.2f}",
      score.median, score.most, score.bias, 100 * score.within, 100 * score.told, field.summary.mean,
      field.summary.sigma, field.summary.if_other, field.summary.chi_square);
}

}  // namespace emberlock::test
