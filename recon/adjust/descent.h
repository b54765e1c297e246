// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "recon/adjust/engine.h"
#include "recon/adjust/guard.h"
#include "recon/adjust/problem.h"
#include "recon/adjust/tracker.h"

namespace emberlock::recon {

/// The pixels of one level of resolution, in interleaved subsets, with one more subset that is held out of
/// the fit.
struct Level {
  Problem problem;
  int subsets = 1;  ///< that are fitted; subset number `subsets` is held out
};

/// The stride, in pixels along both axes, that a grid calls for: about one and a half pixels a voxel are
/// taken. More say no more of the volume: what a step costs falls with the square, what it reaches doesn't.
int stride_for(const SolverSetup& setup, const Grid& grid);
/// Pixels across a voxel in the middle of the grid, in the view that shows it smallest.
double pixels_per_voxel(const SolverSetup& setup, const Grid& g);
/// The same for about so many pixels of all flames' boxes together.
int stride_for_rays(const SolverSetup& setup, std::size_t rays);

/// The hull on a grid that was halved until it has at most so many voxels along its longest side.
Hull coarsen_to(const Hull& hull, int most_voxels);

/// Every `stride`-th pixel along both axes. `most_subsets` is 1, 4 or 16; a thick medium or few pixels take
/// fewer. What is held out is some of all views' pixels, or one view as a whole.
Level make_level(const SolverSetup& setup, const Hull& hull, int stride, int most_subsets = 16,
                 std::optional<std::size_t> left_out = {});

/// How firmly two neighbours are tied at least, over the mean of A^T A 1.
constexpr double kLeastSmoothness = 0.04;

/// Whose light a descent starts from, of the same grid or one half as fine, and what extinction is expected
/// under that, where the optics take a field. Or a volume of the whole grid with both. From darkness where
/// there is none.
struct DescentStart {
  const Engine* from = nullptr;
  const Extinction* expected = nullptr;
  const Volume* volume = nullptr;
};

/// Which of setup.options.starts shows the level's held-out pixels (or its first subset, where there are
/// none) best, and how well; nothing if none does better than no light.
struct BestStart {
  std::size_t which = 0;
  double error = 0;  ///< as Descent::validation_error()
};
std::optional<BestStart> best_start(const Level& level, const SolverSetup& setup);

/// The default solver's iteration on one level: minimises |A x - seen|^2 with a light Huber total variation
/// over x >= 0, by preconditioned ordered-subset steps with Nesterov's momentum.
///
/// Why it doesn't diverge. With F_s = N / N_s |A_s x - seen_s|^2 / 2 of the subset s (N_s of the N rays), the
/// weight of a key point is W = max over s of N / N_s A_s^T A_s 1, plus a floor. All entries of A are >= 0,
/// so diag(W) majorises the Hessian of every F_s (De Pierro 1995). The total variation is majorised at the
/// beginning of a pass by a parabola whose Hessian 2 diag(T) majorises, T being the sum of a key point's ties
/// t (update.h), and both together by D = W + 2 T. So within a pass a step x - D^-1 (grad F_s + slope),
/// projected on x >= 0, is nonexpansive in the norm of D: it brings no two points farther apart, whichever
/// subset comes next, and without momentum the iterates stay as near to any point that the pass leaves in
/// place as they were. From pass to pass T is renewed, and the norm with it. That the objective falls all
/// the same is what majorisation-minimisation says of steps by the full gradient (one subset) alone. Momentum
/// isn't covered either: it starts anew whenever a pass raises the error (O'Donoghue and Candes 2015). Nor is
/// an extinction that moves along, whose problem isn't convex. A Guard looks after all of it.
class Descent {
 public:
  /// The level and the pool must outlive it.
  Descent(const Level& level, const Optics& optics, const SolverSetup& setup, const DescentStart& start = {});

  /// From here on the extinction moves too, held to what it is now by the total variation of their
  /// difference. Absorb::field alone.
  void release_extinction();
  /// One pass over all subsets. One that finds that the steps before it went too far is taken back, with
  /// them, and the next ones are half as long. Throws Diverged where that doesn't help.
  Guard::Finding pass();
  /// What the rays show besides the volume's light has changed (Engine::set_offset): earlier errors say
  /// nothing.
  void begin_anew();
  /// The rays' pictures have changed, or x has been set: what x shows of them now is the limit, or no light
  /// where that is worse; the next steps are full ones.
  void see_anew();
  /// Judges x itself, which no pass has yet, by all of the level's rays (engine().residuals()); fit_error().
  double judge();
  /// Whether the guard has nothing against such an error.
  [[nodiscard]] bool allows(double error) const { return guard_.allows(error); }
  /// x, of that judge(), becomes the best that was kept if that shows no more; whether it did.
  bool take_kept(double judged);
  /// The error of the best that was kept, as a pass found it: that of x as the pass began.
  [[nodiscard]] double kept_error() const { return guard_.best(); }
  /// judge(), and where steps went too far, now or before, take_kept(). For who ends here.
  void settle();
  /// RMS over the fitted rays, each as its subset's step found it; grey levels.
  [[nodiscard]] double rms_of_residuals(std::size_t first_ray, std::size_t last_ray) const;
  [[nodiscard]] double fit_error() const;
  /// Renders the held-out pixels, or the first subset where there are none, for validation_error().
  void show_validation();
  /// RMS over what show_validation() rendered, grey levels. On a GPU it waits for it, so ask where it counts.
  [[nodiscard]] double validation_error() const;
  [[nodiscard]] Engine& engine() { return *engine_; }
  /// What ties neighbours to each other: Stiffen's `most` and `soft`, and DescendField's once the extinction
  /// is released.
  struct Ties {
    float most = 0, soft = 0;
    std::optional<Engine::FieldStep> field;
  };
  [[nodiscard]] Ties ties() const { return {stiffness_, soft_, field_}; }
  /// For who ends here.
  [[nodiscard]] std::unique_ptr<Engine> take_engine() { return std::move(engine_); }
  [[nodiscard]] int halvings() const { return guard_.halvings(); }

 private:
  [[nodiscard]] std::size_t rays_of(int subset) const;
  [[nodiscard]] int validation_subset() const { return rays_of(level_.subsets) > 0 ? level_.subsets : 0; }
  /// All fitted rays over those of the subset.
  [[nodiscard]] float share(int subset) const;
  template <class Act>
  void each_subset(const Act& act);
  [[nodiscard]] double black_error() const;
  [[nodiscard]] double start_error();
  void find_weights();

  const Level& level_;
  std::unique_ptr<Engine> engine_;
  std::size_t fitted_ = 0;
  Guard guard_;
  float stiffness_ = 0;  // at most
  float soft_ = 0;       // grey levels a voxel edge
  float length_ = 1;     // of the steps; half as long each time that they were taken back
  double momentum_time_ = 1;
  double last_error_ = 0;                   // of the pass before; infinite before the first
  std::optional<Engine::FieldStep> field_;  // once the extinction is released
};

}  // namespace emberlock::recon
