// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "recon/adjust/descent.h"

namespace emberlock::recon {

/// Tests whether a model also describes the medium from other directions, which pixels between fitted pixels
/// don't show (cross-validation: Stone 1974). The input views are left out of cold solves on a coarse grid,
/// one at a time, and compared with the result.
class LeftOutViews {
 public:
  /// Leaves out at most four of the input views, spread over them, on a hull of at most 64 voxels along its
  /// longest side. The setup must outlive it.
  LeftOutViews(const SolverSetup& setup, const Hull& fine);

  /// Whether there are enough views: two must remain.
  [[nodiscard]] bool any() const { return !levels_.empty(); }
  /// RMS over the left-out views' pixels that see the hull, grey levels; infinite if a solve diverged.
  /// `extinction`: as in cold_solve().
  [[nodiscard]] double error(const Extinction& extinction, double smoothness) const;

 private:
  const SolverSetup& setup_;
  Hull hull_;
  std::vector<Level> levels_;  // one per left-out view
};

struct FoundSmoothness {
  double value = kLeastSmoothness;
  double error =
      std::numeric_limits<double>::infinity();  ///< LeftOutViews::error() with it, if it was computed
};
/// The smoothness (stiffness between neighbours) with the lowest left-out error: kLeastSmoothness, or one of
/// a few multiples if it lowers the error enough. Ends with the best so far once `late` returns true; each
/// value needs up to four cold solves.
FoundSmoothness find_smoothness(const LeftOutViews& views, const Extinction& extinction,
                                const std::function<bool()>& late = {});

}  // namespace emberlock::recon
