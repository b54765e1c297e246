// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "recon/adjust/descent.h"

namespace emberlock::recon {

/// What pixels between fitted pixels can't tell, a view that wasn't fitted does: whether a model shows the
/// medium as it looks from elsewhere. One input view after the other is left out of cold solves on a coarse
/// grid, and looked at (cross-validation: Stone 1974).
class LeftOutViews {
 public:
  /// At most four of the input views are left out, spread over them. The setup and the hull's grid must
  /// outlive it.
  LeftOutViews(const SolverSetup& setup, const Hull& fine);

  /// Whether there are views enough: two must be left.
  [[nodiscard]] bool any() const { return !levels_.empty(); }
  /// RMS over the left-out views' pixels that see the hull, grey levels; infinite where a solve diverged.
  /// `extinction`: as cold_solve()'s.
  [[nodiscard]] double error(const Extinction& extinction, double smoothness) const;

 private:
  const SolverSetup& setup_;
  Hull hull_;
  std::vector<Level> levels_;  // one a left-out view
};

struct FoundSmoothness {
  double value = kLeastSmoothness;
  double error = std::numeric_limits<double>::infinity();  ///< LeftOutViews::error() with it, if looked at
};
/// How firmly neighbours are tied that shows left-out views best: kLeastSmoothness, or one of a few
/// multiples, where it lowers the error by a share that counts. Ends with the best so far once `late` says
/// so; each value that is tried takes up to four cold solves.
FoundSmoothness find_smoothness(const LeftOutViews& views, const Extinction& extinction,
                                const std::function<bool()>& late = {});

}  // namespace emberlock::recon
