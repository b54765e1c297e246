// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align_choice.h"

#include <algorithm>
#include <cmath>

#include "smear_sync/align/reset_delay.h"

namespace emberlock::smear {
namespace {

/// The number of resets that a camera counts for which can't be moved: more than anybody makes.
constexpr double kNever = 1e6;

}  // namespace

double chance(const AlignScene& scene, std::size_t camera, Seconds target) {
  const ResetLanding& landing = scene.landings[camera];
  switch (landing.method) {
    case ShutterReset::none:
      return 0;
    case ShutterReset::by_hand:
      return chance_by_hand(landing.shifts, -scene.error(camera, target), scene.tolerance, scene.period);
    case ShutterReset::on_command:
      break;
  }
  const double even = std::min(1.0, 2 * (scene.tolerance / scene.period));
  if (!scene.timed(camera) || !landing.aim) return even;
  return std::max(even, chance_within(scene.tolerance, *landing.aim));
}

Seconds choose_target(const AlignScene& scene) {
  if (scene.policy == AlignPolicy::fixed_reference) return scene.tau[scene.reference];
  Seconds best;
  double fewest = INFINITY;
  Seconds tightest;
  for (const Seconds from : scene.tau) {
    const auto behind = [&](Seconds tau) { return wrap_positive(tau - from, scene.period); };
    Seconds width;
    for (const Seconds tau : scene.tau) {
      if (in_picoseconds(behind(tau)) <= in_picoseconds(2 * scene.tolerance))
        width = std::max(width, behind(tau));
    }
    const Seconds middle = wrap_positive(from + width / 2, scene.period);
    double resets = 0;
    for (std::size_t i = 0; i < scene.tau.size(); ++i) {
      if (behind(scene.tau[i]) <= width) continue;
      resets += std::min(kNever, 1 / chance(scene, i, middle));
    }
    const bool equal = std::abs(resets - fewest) < 1e-9 * (1 + resets);
    if (equal ? in_picoseconds(width) < in_picoseconds(tightest) : resets < fewest) {
      best = middle;
      fewest = resets;
      tightest = width;
    }
  }
  return best;
}

std::vector<bool> choose_resets(const AlignScene& scene, Seconds target) {
  std::vector<bool> chosen(scene.tau.size(), false);
  std::vector<std::size_t> drawn;  // phases that would be drawn at random
  for (std::size_t i = 0; i < scene.tau.size(); ++i) {
    if (scene.within(i, target) || !scene.movable(i)) continue;
    const bool at_once = scene.policy == AlignPolicy::fixed_reference || scene.timed(i);
    if (at_once) {
      chosen[i] = true;
    } else {
      drawn.push_back(i);
    }
  }
  // A phase drawn at random lands within tolerance with probability 2 tolerance / T, and each that lands may
  // move the target to where a camera that waits is within tolerance already. So the farthest go first, no
  // more of them at once than land half a camera.
  const auto most = static_cast<std::size_t>(std::max(1.0, scene.period / scene.tolerance / 4));
  std::stable_sort(drawn.begin(), drawn.end(), [&](std::size_t a, std::size_t b) {
    return in_picoseconds(abs(scene.error(a, target))) > in_picoseconds(abs(scene.error(b, target)));
  });
  drawn.resize(std::min(drawn.size(), most));
  for (const std::size_t i : drawn) chosen[i] = true;
  return chosen;
}

}  // namespace emberlock::smear
