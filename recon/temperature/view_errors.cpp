// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/view_errors.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "recon/compute/pool.h"
#include "recon/temperature/neighbour_mean.h"

namespace emberlock::recon {
namespace {

constexpr std::array<std::array<std::size_t, 2>, 6> kPairs = {
    {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};

/// Sums of deviations from the whole volume, and of their products.
struct Deviations {
  std::vector<float> emission, products, extinction, squares;
  Deviations(std::size_t points, bool with_extinction)
      : emission(3 * points),
        products(6 * points),
        extinction(with_extinction ? points : 0),
        squares(extinction) {}

  void add(const Volume& whole, const Volume& other, Pool& pool) {
    constexpr int kTasks = 64;
    pool.run(kTasks, [&](int task) {
      const auto [begin, end] = slice(products.size() / 6, kTasks, task);
      for (std::size_t p = begin; p < end; ++p) {
        std::array<float, 3> d = {};
        for (std::size_t c = 0; c < 3; ++c) d[c] = other.emission[3 * p + c] - whole.emission[3 * p + c];
        for (std::size_t c = 0; c < 3; ++c) emission[3 * p + c] += d[c];
        for (std::size_t i = 0; i < 6; ++i) products[6 * p + i] += d[kPairs[i][0]] * d[kPairs[i][1]];
        if (extinction.empty()) continue;
        const float e = (other.extinction.empty() ? 0 : other.extinction[p]) - whole.extinction[p];
        extinction[p] += e;
        squares[p] += e * e;
      }
    });
  }
};

VolumeErrors variances(Deviations sums, const Grid& grid, int groups, Pool& pool) {
  const auto g = static_cast<float>(groups);
  for (std::size_t p = 0; p < sums.products.size() / 6; ++p)
    for (std::size_t i = 0; i < 6; ++i) {
      float& value = sums.products[6 * p + i];
      value -= sums.emission[3 * p + kPairs[i][0]] * sums.emission[3 * p + kPairs[i][1]] / g;
      value *= (g - 1) / g;
      if (kPairs[i][0] == kPairs[i][1]) value = std::max(0.0F, value);
    }
  for (std::size_t p = 0; p < sums.squares.size(); ++p)
    sums.squares[p] =
        std::max(0.0F, (sums.squares[p] - sums.extinction[p] * sums.extinction[p] / g) * (g - 1) / g);
  take_neighbour_mean(sums.products, 6, grid, pool);
  take_neighbour_mean(sums.squares, sums.squares.empty() ? 0 : 1, grid, pool);
  for (float& v : sums.squares) v = std::sqrt(v);
  return {.emission = std::move(sums.products), .extinction = std::move(sums.squares), .solves = groups};
}

int left_out_groups(const Scene& scene) {
  const auto inputs = std::count_if(scene.views.begin(), scene.views.end(),
                                    [](const View& v) { return v.role == ViewRole::input; });
  return std::min(static_cast<int>(inputs), kMostLeftOut);
}

}  // namespace

Eigen::Matrix3d VolumeErrors::covariance(std::size_t point) const {
  Eigen::Matrix3d out;
  for (std::size_t i = 0; i < 6; ++i) {
    const auto a = static_cast<Eigen::Index>(kPairs[i][0]);
    const auto b = static_cast<Eigen::Index>(kPairs[i][1]);
    out(a, b) = out(b, a) = static_cast<double>(emission[6 * point + i]);
  }
  return out;
}

Eigen::Vector3d VolumeErrors::sigma(std::size_t point) const {
  return covariance(point).diagonal().cwiseSqrt();
}

LeftOutGroup leave_out(const Scene& scene, int group) {
  const int groups = left_out_groups(scene);
  LeftOutGroup parts{scene, scene};
  parts.left_out.views.clear();
  parts.others.views.clear();
  int input = 0;
  for (const View& view : scene.views) {
    if (view.role != ViewRole::input) continue;
    (input++ % groups == group ? parts.left_out : parts.others).views.push_back(view);
  }
  return parts;
}

SolveOptions to_solve_again(const Reconstruction& done, const SolveOptions& options) {
  SolveOptions again = options;
  again.budget.reset();
  again.target_rmse.reset();
  again.smoothness = done.smoothness;
  again.iterations = std::max(1, done.kept.iteration);
  return again;
}

Result<VolumeErrors> errors_by_views(const Scene& scene, const Reconstruction& done,
                                     const SolveOptions& options, const Elapsed& elapsed,
                                     const Progress& progress) {
  const auto inputs = static_cast<int>(std::count_if(
      scene.views.begin(), scene.views.end(), [](const View& v) { return v.role == ViewRole::input; }));
  if (inputs < 3)
    return Error{ErrorKind::bad_input,
                 fmt::format("errors are found by leaving views out, and there are {} input views", inputs),
                 "--errors", "Give three views or more"};
  const int groups = left_out_groups(scene);
  const Seconds start = elapsed ? elapsed() : Seconds(0);
  const SolveOptions again = to_solve_again(done, options);
  Pool pool(options.compute.threads);
  Deviations sums(done.volume.grid.size(), !done.volume.extinction.empty());
  for (int group = 0; group < groups; ++group) {
    tell(progress, static_cast<double>(group) / groups,
         fmt::format("errors: without views {} of {}", group + 1, groups));
    EMBERLOCK_ASSIGN_OR_RETURN(
        const Reconstruction other,
        solve(leave_out(scene, group).others, done.volume.grid, done.effects, again, elapsed));
    if (is_stopped(options))
      return Error{ErrorKind::refused, "ended early, as asked, before its errors were known", "--errors"};
    sums.add(done.volume, other.volume, pool);
  }
  VolumeErrors errors = variances(std::move(sums), done.volume.grid, groups, pool);
  if (elapsed) errors.time = elapsed() - start;
  return errors;
}

Status add_errors_by_models(const Scene& scene, const Reconstruction& done,
                            const std::vector<Extinction>& alternatives, const SolveOptions& options,
                            VolumeErrors& errors, const Elapsed& elapsed, const Progress& progress) {
  const Seconds start = elapsed ? elapsed() : Seconds(0);
  const SolveOptions again = to_solve_again(done, options);
  Pool pool(options.compute.threads);
  Deviations sums(done.volume.grid.size(), !errors.extinction.empty());
  for (const Extinction& alternative : alternatives) {
    tell(progress, 0.5, "errors: with another extinction");
    Effects effects = done.effects;
    effects.extinction = alternative;
    const auto other = solve(scene, done.volume.grid, effects, again, elapsed);
    if (is_stopped(options))
      return Error{ErrorKind::refused, "ended early, as asked, before its errors were known", "--errors"};
    if (!other.ok()) continue;
    sums.add(done.volume, other->volume, pool);
    ++errors.models;
  }
  if (errors.models == 0) return {};
  const auto models = static_cast<float>(errors.models);
  for (std::size_t i = 0; i < errors.emission.size(); ++i) errors.emission[i] += sums.products[i] / models;
  for (std::size_t p = 0; p < errors.extinction.size(); ++p)
    errors.extinction[p] = std::hypot(errors.extinction[p], std::sqrt(sums.squares[p] / models));
  if (elapsed) errors.time += elapsed() - start;
  return {};
}

}  // namespace emberlock::recon
