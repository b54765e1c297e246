// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/left_out_views.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace emberlock::paper {

LeftOutViews::LeftOutViews(const TomographyInput& input, int stride, std::size_t most, recon::Pool& pool) {
  const std::size_t views = input.views.size();
  const std::size_t count = std::min(most, views);
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t left_out = views * n / count;
    std::vector<const recon::View*> others = input.views;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
    turns_.push_back(
        {std::make_unique<LinearProjector>(others, input.hull, stride, pool),
         std::make_unique<LinearProjector>(std::vector{input.views[left_out]}, input.hull, stride, pool)});
  }
}

double LeftOutViews::error(const Solve& solve) const {
  double squares = 0;
  double values = 0;
  for (const Turn& turn : turns_) {
    squares += sum_of(squares_left(*turn.left_out, solve(*turn.fitted)));
    values += 3 * static_cast<double>(turn.left_out->rays());
  }
  return std::sqrt(squares / std::max(1.0, values));
}

double best_of(double first, double factor, int most, const std::function<double(double)>& error) {
  double best = first;
  double least = std::numeric_limits<double>::infinity();
  int worse = 0;
  for (int n = 0; n < most && worse < 2; ++n) {
    const double value = first * std::pow(factor, n);
    const double found = error(value);
    worse = found < least ? 0 : worse + 1;
    if (!(found < least)) continue;
    least = found;
    best = value;
  }
  return best;
}

}  // namespace emberlock::paper
