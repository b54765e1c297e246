// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/progress.h"
#include "recon/adjust/prepared_scene.h"
#include "recon/adjust/tracker.h"

namespace emberlock::recon {

/// How far a camera points beside what its calibration says, pixels of its picture: what is seen at (x, y) is
/// expected at (x - off.x, y - off.y).
struct PointingError {
  double x = 0;
  double y = 0;
};

struct FoundPointing {
  std::vector<PointingError> off;  ///< one a view of the scene, 0 for those that are right or held out
  double error_before = 0;         ///< RMS of left-out input views in small pictures, grey levels
  double error_after = 0;
  [[nodiscard]] bool any() const;
};

/// Cameras that point beside what their calibration says (a mount that gave way, an approximate pose): their
/// silhouettes then don't meet in one hull. Where silhouettes are coherent (Hernandez, Schmitt and Cipolla
/// 2007), which costs one coarse hull to find out, nothing is searched. Else one input view after the other
/// is left out of a cold coarse solve and registered to what the others show from there; the one that is
/// farthest off is moved, as long as left-out views are shown better by that. Views that are all off by the
/// same turn can't be told from a flame that stands elsewhere. `scene` is linear in light; needs four input
/// views. Under a budget the search ends with what it has by then once a fifth is spent.
FoundPointing find_pointing(const Scene& scene, const Effects& effects, const SolveOptions& options,
                            Pool& pool, const Elapsed& elapsed = {}, const Progress& progress = {});

/// The scene with each camera's principal point moved by what was found.
PreparedScene pointed(const PreparedScene& scene, const FoundPointing& found);

}  // namespace emberlock::recon
