// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "base/progress.h"
#include "base/result.h"
#include "recon/adjust/solver.h"

namespace emberlock::recon {

/// How far a reconstructed volume may be off, at its key points.
struct VolumeErrors {
  std::vector<float> emission;  ///< covariance of R, G and B: rr, rg, rb, gg, gb, bb; 6 * size, (levels/m)^2
  std::vector<float> extinction;  ///< one sigma, 1/m; empty where none was reconstructed
  int solves = 0;                 ///< with so many groups of views left out, one after the other
  int models = 0;                 ///< other extinctions whose deviations are part of it
  Seconds time{0};

  [[nodiscard]] Eigen::Matrix3d covariance(std::size_t point) const;
  [[nodiscard]] Eigen::Vector3d sigma(std::size_t point) const;  ///< of R, G and B
};

/// At most so many groups: each is a solve.
inline constexpr int kMostLeftOut = 10;

/// Of kMostLeftOut groups of input views, spread around, or as many as there are views: one group's, and the
/// others, without views that are held out.
struct LeftOutGroup {
  Scene left_out, others;
};
LeftOutGroup leave_out(const Scene& scene, int group);
/// The same solve as led to a result: its smoothness and number of passes, no budget.
SolveOptions to_solve_again(const Reconstruction& done, const SolveOptions& options);

/// Solves again without each of the input views (or of kMostLeftOut groups of them, spread around), under the
/// same effects, smoothness and number of passes, and takes the jackknife's covariance (Tukey 1958): with g
/// groups, (g - 1) / g times the sum of squared deviations. So it holds what noise does, and what a view
/// more or less would change: cameras that stand a little off, and what few views can't tell. What all views
/// blur alike it doesn't hold. Each point takes the mean over itself and its 26 neighbours, since ten
/// deviations alone tell a variance to a third. Errors: fewer than three input views; what solve() says; of
/// kind refused if `options.stop` asks to end.
Result<VolumeErrors> errors_by_views(const Scene& scene, const Reconstruction& done,
                                     const SolveOptions& options, const Elapsed& elapsed = {},
                                     const Progress& progress = {});

/// Adds what the choice of the extinction leaves open: solves again under each of `alternatives`, which
/// explain the pictures as well (EffectChoice), and adds the mean square of their deviations. One that can't
/// be solved explains nothing and is passed over. Errors: of kind refused if `options.stop` asks to end.
Status add_errors_by_models(const Scene& scene, const Reconstruction& done,
                            const std::vector<Extinction>& alternatives, const SolveOptions& options,
                            VolumeErrors& errors, const Elapsed& elapsed = {}, const Progress& progress = {});

}  // namespace emberlock::recon
