// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "recon/adjust/box_error.h"
#include "recon/adjust/engine.h"
#include "recon/adjust/problem.h"
#include "recon/adjust/solver.h"

namespace emberlock::recon {

struct SolverSetup;

/// The views that a solver never fits, and how far off a solution is of them. While a solver runs, a fixed
/// sample of their pixels tells: every n-th along both axes, n from the scene and the grid alone, so that the
/// sample has at most one pixel for kFittedForOne that are fitted (and need not have fewer than kFewest). All
/// of them are looked at where it matters.
class HeldOut {
 public:
  static constexpr double kFittedForOne = 20;
  static constexpr double kFewest = 1024;

  /// One view at least. What the setup refers to must outlive it.
  HeldOut(const SolverSetup& setup, std::vector<const View*> views, const std::vector<PixelBox>& boxes);

  /// What `offset(views, problem)` gives belongs to what is rendered from here on.
  template <class Offset>
  void set_offset(const Offset& offset) {
    engine_->set_offset(offset(views_, problem_));
  }
  /// RMSE for R, G, B of the sample, and of all pixels. `solution` is of the setup's hull.
  [[nodiscard]] std::array<double, 3> sampled(const ResidualEngine& solution);
  [[nodiscard]] std::array<double, 3> all(const ResidualEngine& solution);
  /// The same of a solution that no engine holds (any longer).
  struct Both {
    std::array<double, 3> sampled, all;
  };
  [[nodiscard]] Both both(const std::vector<Rgba>& x);
  /// Of all pixels, where nothing but the background is shown.
  [[nodiscard]] std::array<double, 3> black() const { return error_.black(); }
  [[nodiscard]] TraceSample sample() const { return sample_; }

 private:
  std::vector<const View*> views_;
  int stride_;
  Problem problem_;  // subset 0: the sample, 1: all others
  std::unique_ptr<ResidualEngine> engine_;
  ErrorOverBoxes sample_error_, error_;
  TraceSample sample_;
};

}  // namespace emberlock::recon
