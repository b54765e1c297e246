// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "recon/adjust/descent.h"

namespace emberlock::recon {

/// The default solver's iteration where light from outside is all that shines (Light): emission and
/// extinction at a key point are the density s times what reaches it, j_c = s l_c with l_c = ambient_c +
/// strength_c R, and s, a voxel edge. By the chain rule the slope by s is sum_c l_c dF/dj_c + dF/ds, which
/// the engine gives, and the curvature sum_c l_c^2 W + V majorises it for fixed R, W and V being those of
/// Descent for emission and extinction. The Huber total variation, subsets, momentum and guard are Descent's
/// too, those of s. R follows the density before each pass (its slope is left out), both colours are then the
/// least squares of the pictures without saturated pixels that are shown bright enough, none below 0: how
/// much light there is and how much it meets only differ by what the medium absorbs, so the density keeps
/// about the scale that it starts from.
///
/// Marches on the level's device, everything else on the CPU.
class LitDescent {
 public:
  /// Starts from that light; with start.expected its luminance becomes the density. The level must be made
  /// with a light in the setup's effects, which is then looked at.
  LitDescent(const Level& level, const SolverSetup& setup, const DescentStart& start);

  /// Which colours the next passes may change; the other is 0.
  enum class Colours { both, strength };
  void free(Colours colours) { colours_ = colours; }
  /// Another light, on the density as it is, or on one of an earlier moment.
  void set_light(const Light& light);
  void set_light(const Light& light, const std::vector<float>& density);
  [[nodiscard]] const std::vector<float>& density() const { return density_; }
  /// One pass over all subsets. Throws Diverged as Descent does.
  Guard::Finding pass();
  /// Makes the volume known to the engine, and its residuals those of all rays. RMS of the fitted ones, grey
  /// levels.
  double judge();
  /// RMS over the held-out pixels, after judge().
  [[nodiscard]] double validation_error() const { return descent_.validation_error(); }
  /// The volume becomes the one that the engine holds, or that before the pass that found the lowest error.
  void take_from_engine();
  void take_best();
  /// take_best(), unless the volume shows the pictures about as well (kRiseThatCounts); whether it did.
  bool take_back_a_rise();
  [[nodiscard]] double lowest_error() const { return guard_.best(); }
  [[nodiscard]] bool allows(double error) const { return guard_.allows(error); }
  [[nodiscard]] Engine& engine() { return descent_.engine(); }
  [[nodiscard]] std::unique_ptr<Engine> take_engine() { return descent_.take_engine(); }
  [[nodiscard]] const Light& light() const { return light_; }
  [[nodiscard]] int halvings() const { return guard_.halvings(); }

 private:
  struct Stiffness {
    std::vector<float> of;  ///< one a key point
    void find(const std::vector<float>& y, const std::vector<float>& weight, const Grid& grid, float most,
              Pool& pool);
  };
  [[nodiscard]] bool has_rays(int subset) const;
  [[nodiscard]] std::vector<Rgba> volume(const std::vector<float>& density) const;
  void shine();
  void fit_colours();
  [[nodiscard]] bool is_bound(const Rgba& seen, std::size_t channel) const;
  void step(int subset, float scale, float momentum);
  [[nodiscard]] double mean_squared_light() const;

  const Level& level_;
  Pool& pool_;
  Descent descent_;  // weights, and the engine
  Light light_;
  Colours colours_ = Colours::both;
  float white_;  // from here on what is seen are bounds, as Optics::white
  std::vector<float> weight_, field_weight_;
  std::vector<float> density_, ahead_, best_, reach_;
  Stiffness stiffness_;
  Guard guard_;
  float smoothness_;
  float length_ = 1;
  double momentum_time_ = 1;
  double last_error_;
};

/// What a LitDescent begins with where there is no coarser solution: a few passes of emission in an even
/// medium, whose luminance spreads the expected density. Must outlive the LitDescent's constructor.
class LitStart {
 public:
  LitStart(const Level& level, const SolverSetup& setup, const Extinction& density);
  [[nodiscard]] DescentStart start() const { return {&glow_->engine(), &density_}; }

 private:
  Extinction density_;
  std::unique_ptr<Descent> glow_;
};

/// So many passes. A light with a direction begins without the ambient one, as all shading is otherwise taken
/// for density at first, and unlearnt slowly.
void descend(LitDescent& descent, int passes);

}  // namespace emberlock::recon
