#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "recon/adjust/engine.h"
#include "recon/adjust/problem.h"
#include "recon/adjust/tracker.h"

namespace emberlock {

/// The pixels of one level of resolution, in interleaved subsets, with one more subset that is held out of
/// the fit.
struct Level {
  Problem problem;
  int subsets = 1;  ///< that are fitted; subset number `subsets` is held out
};

/// Every how manieth pixel along both axes a grid calls for: about one and a half of them across a voxel.
/// More say no more of the volume: what a step costs falls with the square, what it reaches doesn't.
int stride_for(const SolverSetup& setup, const Grid& grid);

/// Every `stride`-th pixel along both axes. `most_subsets` is 1, 4 or 16; a thick medium or few pixels take
/// fewer.
Level pose_level(const SolverSetup& setup, const Hull& hull, int stride, int most_subsets = 16);

/// The default solver's iteration on one level: minimises |A x - seen|^2 with a light Huber total variation
/// over x >= 0, by preconditioned ordered-subset steps with Nesterov's momentum.
class Descent {
 public:
  /// The level and the pool must outlive it. Starts from x: emission, and in lane 3 extinction where the
  /// optics take a field.
  Descent(const Level& level, const Optics& optics, const SolverSetup& setup, const std::vector<Rgba>& x);

  /// From here on the extinction moves too, held to what it is now by the total variation of their
  /// difference. Absorb::field alone.
  void release_extinction();
  /// One pass over all subsets.
  void pass();
  /// RMS over the held-out pixels, or over the first subset where there are none; grey levels.
  [[nodiscard]] double validation_error();
  [[nodiscard]] Engine& engine() { return *engine_; }

 private:
  [[nodiscard]] std::size_t rays_of(int subset) const;
  /// The subsets that curvatures are taken from, and how many times more rays there are in all.
  struct Sample {
    int subsets;
    float times;
  };
  [[nodiscard]] Sample sample() const;
  [[nodiscard]] float mean_emission(const std::vector<Rgba>& of_one, int subsets) const;
  void find_weights(const std::vector<Rgba>& x);

  const Level& level_;
  std::unique_ptr<Engine> engine_;
  std::size_t fitted_ = 0;
  float stiffness_ = 0;  // at most
  float soft_ = 0;       // grey levels a voxel edge
  double momentum_time_ = 1;
  std::optional<Engine::FieldStep> field_;  // once the extinction is released
};

}  // namespace emberlock
