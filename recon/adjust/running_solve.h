// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/result.h"
#include "recon/adjust/descent.h"
#include "recon/adjust/prepared_scene.h"
#include "recon/adjust/solver.h"
#include "recon/effects/refraction.h"

namespace emberlock::recon {

/// A reconstruction that goes on, pass by pass, while its pictures are changed: the default solver's passes
/// at full resolution, from the volume as it is. Nothing is decided anew: effects and smoothness stay what
/// they were, and so does what the medium absorbs, so that edits move light alone. A function of its calls
/// and their order: the same bits for every number of threads.
class RunningSolve {
 public:
  /// Goes on behind `from`, a solve of this scene. Errors: the paper's solver, a light or scattering, which
  /// have no such passes; a device that can't run.
  static Result<std::unique_ptr<RunningSolve>> begin(const PreparedScene& scene, const Reconstruction& from,
                                                     const SolveOptions& options);

  /// The pictures that are fitted from here on; their cameras, sizes and roles are those of before. Where one
  /// has become brighter outside of its flame, the medium grows by what all views allow then; it never
  /// shrinks. Errors: carve()'s.
  Status show(const PreparedScene& scene);
  /// The key points of the whole grid that emit nothing from here on (1) and that may (0). What the former
  /// emitted is laid aside: the others are fitted as if it were still there, so that they don't make up for
  /// it. It is given back where they are dark no longer.
  void keep_dark(const std::vector<std::uint8_t>& dark);
  /// One pass over all rays; the root of their mean squared residual, as the pass met them, grey levels.
  /// Throws Diverged where the guard gives up.
  double pass();

  /// As it is now, without what was laid aside.
  [[nodiscard]] Volume volume() const;
  [[nodiscard]] const Hull& hull() const { return hull_; }
  [[nodiscard]] const Effects& effects() const { return effects_; }

 private:
  RunningSolve(const PreparedScene& scene, const Reconstruction& from, const SolveOptions& options,
               Device device);
  /// The finest level of the hull as it is, and a descent on it from this volume.
  void begin_level(const Volume& from);
  void take_views(const PreparedScene& scene);
  /// Marks where the pictures show light beyond their masks; whether there was any.
  bool widen_masks(const Scene& before, const Scene& after);
  /// Splits all light into what shines and what is laid aside, and says so to the rays.
  void lay_aside(const Volume& all);
  /// With what was laid aside.
  [[nodiscard]] Volume all_light() const;

  SolveOptions options_;
  Effects effects_;
  Pool pool_;
  PreparedScene scene_;
  std::vector<FlameMask> masks_;
  Hull hull_;
  std::optional<RefractiveIndex> gas_;
  SolverSetup setup_;
  std::unique_ptr<Level> level_;
  std::unique_ptr<Descent> descent_;
  std::vector<float> weights_;      // of the descent, before any was darkened
  std::vector<std::uint8_t> dark_;  // one a key point of the whole grid; empty: none
  std::vector<float> aside_;        // emission that was laid aside, as in Volume; empty: none
};

}  // namespace emberlock::recon
