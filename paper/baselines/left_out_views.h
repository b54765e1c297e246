// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "paper/baselines/linear_projector.h"

namespace emberlock::paper {

/// What a method's settings are worth, by the pictures alone: the error in input views that are left out one
/// at a time. Pixels between fitted pixels wouldn't tell: they are shown well by what is wrong from other
/// directions.
class LeftOutViews {
 public:
  /// At most `most` views, spread over the input, are left out in turn. Input and pool must outlive it.
  LeftOutViews(const TomographyInput& input, int stride, std::size_t most, recon::Pool& pool);

  /// A fit to all rays of `fitted` but one view's.
  using Solve = std::function<Light(const LinearProjector& fitted)>;
  /// The root mean square over the rays of the views left out, all channels; grey levels.
  [[nodiscard]] double error(const Solve& solve) const;

 private:
  struct Turn {
    std::unique_ptr<LinearProjector> fitted, left_out;
  };
  std::vector<Turn> turns_;
};

/// The value among first, first * factor, first * factor^2 ... (`most` of them) with the least error(value),
/// which is asked in their order until it has risen twice in a row.
double best_of(double first, double factor, int most, const std::function<double(double)>& error);

}  // namespace emberlock::paper
