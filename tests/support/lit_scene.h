// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "recon/hull/hull.h"
#include "recon/render/lit_medium.h"
#include "recon/render/render.h"
#include "recon/synthetic/flame.h"
#include "tests/support/key_points.h"

namespace emberlock::test {

/// Smoke that only scatters: five puffs in a cube of 20 cm, seen from a ring of cameras; one more view,
/// between the first two, is held out.
struct LitScene {
  int views = 6;
  int truth_voxels = 40;
  double depth = 1.5;  ///< through the thickest puff's middle, about
  int seed = 1;
  ImageSize image{48, 48};
};

struct LitTruth {
  recon::Volume volume;
  recon::Hull medium;
};

/// The n-th of a sequence that fills 0..1 evenly (the golden ratio's), another for each seed.
inline double spread(int n, int seed) {
  return std::fmod(0.5 + 0.618033988749895 * n + 0.271828 * seed, 1.0);
}

inline LitTruth lit_truth(const LitScene& options, const recon::Light& light) {
  const recon::Grid g = cube_grid(0.2, options.truth_voxels);
  LitTruth truth{{g, std::vector<float>(3 * g.size()), std::vector<float>(g.size())}, recon::whole_grid(g)};
  constexpr int kPuffs = 5;
  constexpr double kWidth = 0.021;  // standard deviation, metres
  each_point(g, [&](int i, int j, int k, std::size_t p) {
    double sigma = 0;
    for (int n = 0; n < kPuffs; ++n) {
      const double turn = 2 * std::numbers::pi * spread(n, options.seed);
      const Eigen::Vector3d middle(0.035 * std::cos(turn), 0.035 * std::sin(turn), 0.024 * (n - 2));
      sigma += std::exp(-(place_of(g, i, j, k) - middle).squaredNorm() / (2 * kWidth * kWidth));
    }
    sigma = std::max(0.0, sigma - 0.05) * options.depth / (kWidth * std::sqrt(2 * std::numbers::pi));
    truth.volume.extinction[p] = static_cast<float>(sigma);
  });
  recon::Pool pool(1);
  std::vector<recon::Rgba> medium(g.size());
  for (std::size_t p = 0; p < g.size(); ++p) medium[p].c[3] = g.edge * truth.volume.extinction[p];
  const std::vector<float> reach = recon::light_that_reaches(medium, g, light, pool);
  for (std::size_t p = 0; p < g.size(); ++p)
    for (std::size_t c = 0; c < 3; ++c)
      truth.volume.emission[3 * p + c] =
          truth.volume.extinction[p] * static_cast<float>(light.ambient[c] + light.strength[c] * reach[p]);
  return truth;
}

inline recon::Scene film_lit(const LitScene& options, const LitTruth& truth) {
  recon::Scene scene{{}, {Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}};
  recon::Effects effects;
  effects.extinction.model = recon::Extinction::Model::field;
  for (int v = 0; v <= options.views; ++v) {
    const bool held_out = v == options.views;
    const double turn = 2 * std::numbers::pi * (held_out ? 0.5 : v) / options.views;
    const Eigen::Vector3d from(0.4 * std::cos(turn), 0.4 * std::sin(turn), v % 2 == 0 ? 0.12 : -0.08);
    const double focal = 1.6 * options.image.width;
    recon::View view{
        "camera " + std::to_string(v),
        recon::look_at(
            {options.image, focal, focal, options.image.width / 2.0, options.image.height / 2.0, {}}, from,
            Eigen::Vector3d::Zero()),
        {},
        held_out ? recon::ViewRole::held_out : recon::ViewRole::input};
    view.image = recon::share(recon::render_view(truth.volume, truth.medium, effects, view.camera));
    scene.views.push_back(view);
  }
  return scene;
}

inline recon::Light distant_light(const Eigen::Vector3d& towards) {
  recon::Light light;
  light.source = recon::Light::Source::distant;
  light.place = {towards[0], towards[1], towards[2]};
  light.strength = {260, 230, 200};
  light.ambient = {30, 40, 50};
  return light;
}

}  // namespace emberlock::test
