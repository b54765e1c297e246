#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/progress.h"
#include "base/result.h"
#include "recon/adjust/solver.h"
#include "recon/effects/effects.h"
#include "recon/export/report.h"
#include "recon/preprocess/view.h"

namespace emberlock {

struct ReconstructOptions {
  std::optional<int>
      voxels;  ///< along the box's longest edge, 1..kLargestVoxels; otherwise voxels_by_the_paper()
  /// Otherwise found out from the pictures; for the paper's solver its constant opacity of 0.05 a step.
  std::optional<EffectRequest> effects;
  /// A budget counts from the start of reconstruct() to its end, so it covers the choice of effects, the hull
  /// and the rendering too. Without a flame_threshold the paper's solver takes the paper's 30 grey levels.
  SolveOptions solve;
  /// Given a budget or a target, whatever of voxels, effects and iterations is left open is chosen by the
  /// shipped front, in units of a reference run of the scene at hand (planned_run.h). The paper's solver,
  /// which the front doesn't know, takes the budget and the target as limits alone, as every solver does if
  /// false.
  bool choose_by_front = true;
};

/// A reconstruction with everything that is written about it.
struct Outcome {
  Reconstruction reconstruction;
  std::vector<RadianceImage> renders;  ///< the volume as each view's camera sees it, in the scene's order
  Report report;                       ///< its `input` is the caller's to fill
};

/// Effects, hull, solve, and the rendering of every view, held-out ones too. Everything but the times is a
/// pure function of scene and options, unless a budget ends it. Errors: options out of range, a grid that
/// doesn't fit into this machine's memory, and those of check_scene(), choose_effects() and solve().
Result<Outcome> reconstruct(const Scene& scene, const ReconstructOptions& options, const Clock& clock,
                            const Progress& progress = {},
                            const std::function<void(const Preview&)>& preview = {});

/// Whether write_outcome() may write to `folder`: it is absent, empty, or an earlier result (has a
/// report.json).
Status check_output(const std::filesystem::path& folder);

/// Writes volume.vdb, views/NNNN.png (8 bits, numbered as in the input) and report.json. The folder appears
/// whole, or not at all; an earlier result is replaced.
Status write_outcome(const Outcome& outcome, const std::filesystem::path& folder);

}  // namespace emberlock
