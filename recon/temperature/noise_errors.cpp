// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/noise_errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "base/random.h"
#include "recon/adjust/gauss_newton.h"
#include "recon/effects/refraction.h"
#include "recon/temperature/neighbour_mean.h"

namespace emberlock::recon {
namespace {

constexpr int kProbes = 4;
constexpr int kMostSteps = 24;
constexpr double kResidual = 0.05;
constexpr std::uint64_t kTieStreams = 1000;  // beyond those of the pixels

/// What noise of these sizes, one an input view, adds to the rays of a problem.
std::vector<Rgba> noise_of(const Problem& problem, const std::vector<double>& sizes, std::uint64_t seed,
                           std::uint64_t probe, Pool& pool) {
  std::vector<Rgba> noise(problem.rays());
  constexpr int kTasks = 64;
  pool.run(kTasks, [&](int task) {
    const Slice mine = slice(noise.size(), kTasks, task);
    for (std::size_t r = mine.begin; r < mine.end; ++r)
      for (int c = 0; c < 3; ++c)
        noise[r].c[c] = static_cast<float>(sizes[problem.list.rays[r].view] *
                                           random_normal(seed, 3 * probe + static_cast<std::uint64_t>(c), r));
  });
  return noise;
}

struct Measured {
  SolverSetup setup;
  std::vector<double> noise;  // of the input views
};

Measured measured(const PreparedScene& scene, const Reconstruction& done, const SolveOptions& options,
                  Pool& pool) {
  Measured out{{{}, {}, done.hull, done.effects, options, pool}, {}};
  out.setup.smoothness = done.smoothness;
  const SharedMasks masks = scene.masks(std::nullopt, {Device::cpu, options.compute.threads});
  for (std::size_t v = 0; v < scene.scene().views.size(); ++v) {
    const View& view = scene.scene().views[v];
    if (view.role != ViewRole::input) continue;
    out.setup.views.push_back(&view);
    out.setup.boxes.push_back((*masks)[v].box);
    out.noise.push_back(pixel_noise(*view.image, (*masks)[v]));
  }
  return out;
}

bool is_field(const Reconstruction& done) {
  return done.effects.extinction.model == Extinction::Model::field;
}

/// What isn't 0 becomes the root of the mean square over those of its neighbours that aren't.
void pool_squares(std::vector<float>& values, std::size_t each, const Grid& grid, Pool& pool) {
  if (values.empty()) return;
  std::vector<float> counts(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    counts[i] = values[i] > 0 ? 1 : 0;
    values[i] *= values[i];
  }
  const std::vector<float> own = counts;
  take_neighbour_mean(values, each, grid, pool);
  take_neighbour_mean(counts, each, grid, pool);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = own[i] > 0 ? std::sqrt(values[i] / counts[i]) : 0;
}

double rms(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, values.size())));
}

}  // namespace

double pixel_noise(const RadianceImage& image, const FlameMask& lit) {
  std::vector<float> sizes;
  const auto width = static_cast<std::ptrdiff_t>(image.size.width);
  for (int y = std::max(1, lit.box.y0); y < std::min(image.size.height - 1, lit.box.y1); ++y)
    for (int x = std::max(1, lit.box.x0); x < std::min(image.size.width - 1, lit.box.x1); ++x) {
      if (!lit.at(x, y)) continue;
      const float* here = image.rgb.data() + 3 * (y * width + x);
      for (int c = 0; c < 3; ++c) {
        const auto at = [&](int dx, int dy) { return here[3 * (dy * width + dx) + c]; };
        sizes.push_back(std::abs(at(-1, -1) + at(1, -1) + at(-1, 1) + at(1, 1) + 4 * at(0, 0) -
                                 2 * (at(0, -1) + at(0, 1) + at(-1, 0) + at(1, 0))));
      }
    }
  if (sizes.empty()) return 0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  constexpr double kOperator = 6;               // root of the sum of its squares
  constexpr double kMedianOfNormal = 0.674490;  // of its size
  return static_cast<double>(*middle) / (kOperator * kMedianOfNormal);
}

Result<NoiseErrors> errors_by_noise(const Scene& scene, const Reconstruction& done,
                                    const SolveOptions& options, const Elapsed& elapsed,
                                    const Progress& progress) {
  const Seconds start = elapsed ? elapsed() : Seconds(0);
  EMBERLOCK_ASSIGN_OR_RETURN(const PreparedScene prepared, PreparedScene::create(scene, done.effects));
  Pool pool(options.compute.threads);
  Measured of = measured(prepared, done, options, pool);
  std::optional<RefractiveIndex> index;
  if (done.effects.refraction.rays == Refraction::Rays::curved) {  // as the solver takes it
    index.emplace(assume_temperature(done.hull, {}, done.effects.refraction),
                  done.effects.refraction.ambient);
    of.setup.gas = &*index;
  }
  const Level level = make_level(of.setup, done.hull, stride_for(of.setup, done.volume.grid), 1);
  GaussNewton hessian(level, of.setup, to_solution(done.volume, level.problem, done.effects));
  NoiseErrors out;
  out.noise = rms(of.noise);
  std::vector<Rgba> squares(level.problem.grid().size());
  for (; out.probes < kProbes; ++out.probes) {
    tell(progress, static_cast<double>(out.probes) / kProbes,
         fmt::format("errors: what noise does, {} of {}", out.probes + 1, kProbes));
    const auto probe = static_cast<std::uint64_t>(out.probes);
    const std::vector<Rgba> noise = noise_of(level.problem, of.noise, options.seed, probe, pool);
    std::vector<Rgba> pull = hessian.transpose(noise);
    const std::vector<Rgba> ties = hessian.tie_noise(out.noise, options.seed, kTieStreams + probe);
    for (std::size_t p = 0; p < pull.size(); ++p) pull[p] = pull[p] + ties[p];
    const GaussNewton::Solved moved = hessian.solve(pull, kResidual, kMostSteps);
    if (is_stopped(options))
      return Error{ErrorKind::refused, "ended early, as asked, before its errors were known", "--errors"};
    out.steps += moved.steps;
    for (std::size_t p = 0; p < squares.size(); ++p)
      for (int c = 0; c < 4; ++c) squares[p].c[c] += moved.x[p].c[c] * moved.x[p].c[c] / kProbes;
  }
  for (Rgba& q : squares)
    for (int c = 0; c < 4; ++c) q.c[c] = std::sqrt(q.c[c]);
  Volume sigma = to_volume(squares, level.problem, done.hull, done.effects);
  out.emission = std::move(sigma.emission);
  if (is_field(done)) out.extinction = std::move(sigma.extinction);
  pool_squares(out.emission, 3, done.volume.grid, pool);
  pool_squares(out.extinction, 1, done.volume.grid, pool);
  const auto finite = [](float v) { return std::isfinite(v); };
  if (!std::all_of(out.emission.begin(), out.emission.end(), finite) ||
      !std::all_of(out.extinction.begin(), out.extinction.end(), finite))
    return Error{ErrorKind::not_converged, "what noise does to the volume isn't finite", "--errors",
                 "Leave --errors out, or try fewer voxels"};
  if (elapsed) out.time = elapsed() - start;
  return out;
}

}  // namespace emberlock::recon
