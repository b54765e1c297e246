// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/guard.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace emberlock::recon {
namespace {

// Beyond rounding, and beyond what the order of subsets lets an error waver by at its end.
constexpr double kSlack = 1.05;
constexpr double kRounding = 1e-4;  // grey levels

}  // namespace

Diverged::Diverged(double error, double best)
    : error_{
          ErrorKind::not_converged,
          std::isfinite(best) && std::isfinite(error)
              ? fmt::format("the error rises to {:.3g} grey levels however short the steps "
                            "are; the lowest was {:.3g}",
                            error, best)
              : "the error is not finite however short the steps are",
          "solver",
          "Check the cameras' poses and the box; try fewer voxels, --effects none or --precision float64"} {}

Guard::Finding Guard::look(double error) {
  if (allows(error)) {
    if (!std::isfinite(best_)) start_ = std::min(start_, error);
    if (!(error < best_)) return Finding::fair;
    best_ = error;
    return Finding::best;
  }
  if (halvings_++ >= kMostHalvings) throw Diverged(error, best_);
  return Finding::diverged;
}

void Guard::went_back_to(double error) {
  if (std::isfinite(error)) start_ = std::max(start_, error);
}

void Guard::begin_anew() {
  start_ = black_;
  best_ = std::numeric_limits<double>::infinity();
}

bool Guard::is_bearable(double error, double start) {
  return std::isfinite(error) && error <= kSlack * start + kRounding;
}

}  // namespace emberlock::recon
