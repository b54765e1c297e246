// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/move_together.h"

#include <algorithm>
#include <cmath>

namespace emberlock::smear {
namespace {

constexpr double kAlike = 5;  // standard errors

/// What the cameras' dots moved by beyond what was expected of all: the middle of what they say and of the
/// strobe's own word, the smaller of two.
Seconds common_excess(std::span<const std::optional<DotMove>> cameras, Seconds period) {
  std::vector<Seconds> excess{Seconds(0)};
  for (const auto& move : cameras) {
    if (move) excess.push_back(wrap_symmetric(move->seen - move->expected, period));
  }
  std::sort(excess.begin(), excess.end());
  const Seconds low = excess[(excess.size() - 1) / 2];
  const Seconds high = excess[excess.size() / 2];
  return abs(low) < abs(high) ? low : high;
}

}  // namespace

std::vector<DotMotion> move_together(std::span<const std::optional<DotMove>> cameras, Seconds period) {
  const Seconds common = common_excess(cameras, period);
  std::vector<DotMotion> motions(cameras.size(), DotMotion::untold);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (!cameras[i]) continue;
    const DotMove& move = *cameras[i];
    const Seconds allowed = kAlike * move.sigma;
    const auto moved_by = [&](Seconds by) { return abs(wrap_symmetric(move.seen - by, period)) <= allowed; };
    if (abs(wrap_symmetric(move.strobe, period)) <= 2 * allowed) continue;
    const Seconds way = move.expected + common;
    const bool same_back = abs(wrap_symmetric(2 * way, period)) <= 2 * allowed;
    if (moved_by(Seconds(0))) {
      motions[i] = DotMotion::none;
    } else if (same_back && (moved_by(way) || moved_by(-way))) {
      continue;  // by half a period, there and back are the same
    } else if (moved_by(way)) {
      motions[i] = DotMotion::with_all;
    } else if (moved_by(-way)) {
      motions[i] = DotMotion::against;
    } else {
      motions[i] = DotMotion::otherwise;
    }
  }
  return motions;
}

}  // namespace emberlock::smear
