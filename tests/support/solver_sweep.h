// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "recon/adjust/choose_effects.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/solver.h"
#include "tests/support/ball_scene.h"

namespace emberlock {

/// Geometries, sizes and settings that nobody chose: each number of a case is drawn from its hash.
struct SweepLimits {
  int widest = 1280;
  int most_voxels = 256;
};

struct SweepCase {
  BallOptions ball;
  int voxels = 0;
  std::string effects;  ///< none, auto or field
  recon::Solver solver = recon::Solver::standard;
  recon::Precision precision = recon::Precision::float32;

  [[nodiscard]] std::string words() const {
    return fmt::format(
        "{} views, height {:.0f}, width {}, {} voxels, box {:.2g} m, offset {:.1f}, noise {:.1f} %, "
        "effects {}, {}, {}",
        ball.views, ball.height, ball.image.width, voxels, ball.edge, ball.offset, ball.noise, effects,
        solver == recon::Solver::paper ? "paper" : "default",
        precision == recon::Precision::float64 ? "float64" : "float32");
  }
};

inline SweepCase sweep_case(int number, const SweepLimits& limits) {
  std::uint64_t drawn = 0;
  const auto draw = [&] {
    return static_cast<double>(random_bits(42, static_cast<std::uint64_t>(number), drawn++) >> 11) /
           9007199254740992.0;
  };
  const auto between = [&](double low, double high) { return low * std::pow(high / low, draw()); };
  SweepCase c;
  c.ball.views = 2 + static_cast<int>(27 * draw());
  c.ball.height = draw() < 0.3 ? 0 : 60 * draw();
  c.ball.image.width = static_cast<int>(between(24, limits.widest));
  c.ball.image.height = c.ball.image.width * 3 / 4;
  c.voxels = static_cast<int>(between(8, limits.most_voxels + 1));
  c.ball.edge = between(1e-3, 10);
  c.ball.offset = draw() < 0.5 ? 0 : 3 * draw();
  c.ball.noise = draw() < 0.5 ? 0 : 10 * draw();
  c.ball.seed = static_cast<std::uint64_t>(number);
  const double effects = draw();
  c.effects = effects < 0.4 ? "none" : effects < 0.7 ? "auto" : "field";
  c.solver = draw() < 0.25 ? recon::Solver::paper : recon::Solver::standard;
  if (c.solver == recon::Solver::standard && draw() < 0.25) c.precision = recon::Precision::float64;
  return c;
}

struct SweepOutcome {
  Result<recon::Reconstruction> solved;
  double black = 0;  ///< held-out error of no light, over the same box as the trace's

  /// Of the error of no light, that which is left; for what was solved.
  [[nodiscard]] double share() const {
    return recon::all_channels(solved->trace.back().heldout_rmse) / black;
  }
  /// Found better than no light, or a clear error; nothing between.
  [[nodiscard]] bool good() const {
    if (!solved) return !solved.error().what.empty() && !solved.error().remedy.empty();
    const auto holds = [](float v) { return std::isfinite(v) && v >= 0; };
    return std::all_of(solved->volume.emission.begin(), solved->volume.emission.end(), holds) &&
           std::all_of(solved->volume.extinction.begin(), solved->volume.extinction.end(), holds) &&
           share() < 1;
  }
  [[nodiscard]] std::string words() const {
    if (!solved) return solved.error().message();
    return fmt::format("held-out {:.2f} of {:.2f} grey levels, {} iterations, {} halvings, smoothness {:.2f}",
                       recon::all_channels(solved->trace.back().heldout_rmse), black, solved->iterations,
                       solved->halvings, solved->smoothness);
  }
};

inline SweepOutcome solve_case(const SweepCase& c, recon::Device device) {
  const recon::Scene scene = ball_scene(c.ball);
  const recon::Grid grid = recon::grid_over(scene.box, c.voxels);
  recon::SolveOptions options;
  options.compute.device = device;
  options.solver = c.solver;
  options.precision = c.precision;
  if (c.solver == recon::Solver::paper) options.iterations = 30;
  recon::Effects effects;
  const recon::RadianceImage& last = *scene.views.back().image;
  const double black = recon::all_channels(recon::rmse(
      recon::RadianceImage(last.size), last, recon::flame_mask(last, recon::noise_threshold(last)).box));
  if (c.solver == recon::Solver::paper) {
    if (c.effects != "none")
      effects = recon::absorbing(recon::extinction_of_opacity(0.05, Meters(static_cast<double>(grid.edge))));
  } else if (c.effects == "field") {
    effects.extinction = {recon::Extinction::Model::field, PerMeter(0.5 / c.ball.edge),
                          PerMeter(0.5 / c.ball.edge)};
  } else if (c.effects == "auto") {
    const auto choice = recon::choose_effects(scene, grid, {}, options);
    if (!choice) return {choice.error(), black};
    effects = choice->effects;
  }
  return {recon::solve(scene, grid, effects, options), black};
}

}  // namespace emberlock
