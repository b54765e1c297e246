// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/left_out_views.h"

#include <algorithm>
#include <cmath>

#include "recon/adjust/cold_solve.h"

namespace emberlock::recon {
namespace {

constexpr int kFoldVoxels = 64;             // along the longest side, at most
constexpr std::size_t kFoldPixels = 30000;  // of the flames' boxes
constexpr std::size_t kMostFolds = 4;
constexpr std::size_t kFewestFitted = 2;        // views
constexpr double kLeastGainOfSmoothing = 0.01;  // a smoother volume must lower the error by this share

}  // namespace

LeftOutViews::LeftOutViews(const SolverSetup& setup, const Hull& fine)
    : setup_(setup), hull_(coarsen_to(fine, kFoldVoxels)) {
  const std::size_t views = setup.views.size();
  if (views < kFewestFitted + 1) return;
  const std::size_t folds = std::min(kMostFolds, views);
  const int stride = std::max(stride_for(setup, hull_.grid), stride_for_rays(setup, kFoldPixels));
  for (std::size_t f = 0; f < folds; ++f)
    levels_.push_back(make_level(setup, hull_, stride, 4, f * views / folds));
}

double LeftOutViews::error(const Extinction& extinction, double smoothness) const {
  SolverSetup setup = setup_;
  setup.smoothness = smoothness;
  std::vector<double> errors(levels_.size());
  at_once(setup.pool, static_cast<int>(levels_.size()), [&](int f) {
    const auto fold = static_cast<std::size_t>(f);
    errors[fold] = cold_solve(setup, levels_[fold], extinction).error;
  });
  double sum = 0;
  for (const double e : errors) sum += e * e;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, levels_.size())));
}

FoundSmoothness find_smoothness(const LeftOutViews& views, const Extinction& extinction,
                                const std::function<bool()>& late) {
  if (!views.any() || (late && late())) return {};
  FoundSmoothness best{kLeastSmoothness, views.error(extinction, kLeastSmoothness)};
  for (const double times : {4.0, 16.0, 64.0}) {
    if (late && late()) break;
    const FoundSmoothness next{times * kLeastSmoothness, views.error(extinction, times * kLeastSmoothness)};
    if (!(next.error < (1 - kLeastGainOfSmoothing) * best.error)) break;
    best = next;
  }
  return best;
}

}  // namespace emberlock::recon
