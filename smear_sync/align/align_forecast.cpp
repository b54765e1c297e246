// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align_forecast.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "base/random.h"

namespace emberlock::smear {
namespace {

constexpr int kPlays = 200;
constexpr std::uint64_t kSeed = 0x0ff3;
/// What a timed reset of a camera that nothing has been learnt of errs by, once another has been taught.
constexpr Seconds kUntaughtSpread = milliseconds(5);
/// Rounds of filming that trims take to stop cleanly.
constexpr double kForetoldSettling = 3;

struct Play {
  int resets = 0;
  double seconds = 0;
  bool done = false;
};

/// Draws what the reset of one camera does to it.
Seconds landed(const AlignScene& scene, std::size_t camera, Seconds target, RandomStream& random) {
  const ResetLanding& landing = scene.landings[camera];
  if (scene.timed(camera) && landing.aim) return target + Seconds(random.normal(0, landing.aim->value()));
  const Seconds even = scene.period * random.uniform();
  if (landing.shifts.empty()) return even;
  const auto seen = static_cast<double>(landing.shifts.size());
  const auto one = static_cast<std::size_t>(random.uniform() * (seen + 8));
  return one < landing.shifts.size() ? scene.tau[camera] + landing.shifts[one] : even;
}

/// One round's resets. A model is taught by one camera; the others wait for it.
int carry_out(AlignScene& scene, const std::vector<bool>& chosen, Seconds target, Seconds jitter,
              RandomStream& random) {
  int resets = 0;
  std::vector<std::string_view> taught;
  const auto is_taught = [&](const ResetLanding& landing) {
    return std::find(taught.begin(), taught.end(), landing.model) != taught.end();
  };
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (!chosen[i]) continue;
    const bool teaches = scene.timed(i) && !scene.landings[i].aim;
    if (teaches && is_taught(scene.landings[i])) continue;
    if (teaches) taught.push_back(scene.landings[i].model);
    scene.tau[i] = wrap_positive(landed(scene, i, target, random), scene.period);
    scene.landings[i].aim = jitter * std::sqrt(2.0);
    ++resets;
  }
  for (ResetLanding& landing : scene.landings) {
    if (!landing.aim && is_taught(landing)) landing.aim = kUntaughtSpread;
  }
  return resets;
}

Play play(const Prospect& prospect, AlignPolicy policy, Seconds tolerance, const AlignOptions& options,
          RandomStream random) {
  AlignScene scene = prospect.scene;
  scene.policy = policy;
  const Seconds reach = trim_reach(prospect.trims, options);
  const bool trimmed = policy == AlignPolicy::trimmed;
  scene.tolerance = trimmed ? std::max(reach, tolerance) : tolerance;
  const AlignLimits limits = options.limits.value_or(AlignLimits{});
  std::vector<double> speeds;
  for (const Drift& drift : prospect.drifts)
    speeds.push_back(1e-6 * random.normal(drift.rate.value(), drift.rate_sigma.value()));

  Play result;
  for (;;) {
    const Seconds target = choose_target(scene);
    const std::vector<bool> chosen = choose_resets(scene, target);
    double seconds = options.round_time.value();
    result.seconds += seconds;
    const bool inside = [&] {
      for (std::size_t i = 0; i < scene.tau.size(); ++i) {
        if (!scene.within(i, target)) return false;
      }
      return true;
    }();
    if (inside && !trimmed && options.strobe_step > Seconds(0))
      result.seconds += seconds;  // to see the dots move
    if (inside && trimmed) {
      Seconds farthest;
      for (std::size_t i = 0; i < scene.tau.size(); ++i)
        farthest = std::max(farthest, abs(scene.error(i, target)));
      result.seconds += farthest / reach * options.trim_time.value() + kForetoldSettling * seconds;
    }
    const int resets = carry_out(scene, chosen, target, prospect.jitter, random);
    result.resets += resets;
    const double acting = resets * options.reset_time.value() + (resets > 0 ? options.sweep_time.value() : 0);
    result.seconds += acting;
    const bool over = result.resets > limits.resets || result.seconds > limits.time.value();
    if (over || inside || resets == 0) {
      result.done = inside && !over;
      return result;
    }
    seconds += acting;
    for (std::size_t i = 0; i < scene.tau.size(); ++i)
      scene.tau[i] = wrap_positive(scene.tau[i] + Seconds(speeds[i] * seconds), scene.period);
  }
}

template <class T>
T percentile_95(std::vector<T> values) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

bool within_limits(const AlignEffort& effort, const AlignOptions& options) {
  return effort.within >= options.limits.value_or(AlignLimits{}).probability;
}

bool possible(const Prospect& prospect, AlignPolicy policy, const AlignOptions& options) {
  const auto& landings = prospect.scene.landings;
  const bool on_command = std::all_of(landings.begin(), landings.end(), [](const ResetLanding& landing) {
    return landing.method == ShutterReset::on_command;
  });
  if (policy == AlignPolicy::timed) return on_command;
  if (policy == AlignPolicy::trimmed) return trim_reach(prospect.trims, options) > Seconds(0);
  return true;
}

}  // namespace

Seconds trim_reach(const std::vector<std::optional<FrameRateTrim>>& trims, const AlignOptions& options) {
  Seconds reach = options.period;
  for (const auto& trim : trims) {
    if (!trim) return Seconds(0);
    reach = std::min(reach, options.trim_time * ((trim->range - trim->step).value() * 1e-6));
  }
  return reach;
}

AlignEffort foretell(const Prospect& prospect, AlignPolicy policy, Seconds tolerance,
                     const AlignOptions& options) {
  AlignEffort effort;
  std::vector<int> resets;
  std::vector<double> seconds;
  int done = 0;
  for (int i = 0; i < kPlays; ++i) {
    const Play one =
        play(prospect, policy, tolerance, options, RandomStream(kSeed, static_cast<std::uint64_t>(i)));
    resets.push_back(one.resets);
    seconds.push_back(one.seconds);
    effort.resets += static_cast<double>(one.resets) / kPlays;
    effort.time += Seconds(one.seconds / kPlays);
    done += one.done ? 1 : 0;
  }
  effort.resets_p95 = percentile_95(resets);
  effort.time_p95 = Seconds(percentile_95(seconds));
  effort.within = static_cast<double>(done) / kPlays;
  return effort;
}

std::vector<AlignOffer> find_offers(const Prospect& prospect, const AlignOptions& options) {
  std::vector<AlignOffer> offers;
  const Seconds asked = options.tolerance.in_time(options.row_time);
  for (const AlignPolicy policy : {AlignPolicy::timed, AlignPolicy::trimmed}) {
    if (policy == options.policy || !possible(prospect, policy, options)) continue;
    const AlignEffort effort = foretell(prospect, policy, asked, options);
    if (within_limits(effort, options)) offers.push_back({policy, options.tolerance, effort});
  }
  for (const double rows :
       {1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 70.0, 100.0, 150.0, 200.0}) {
    const Tolerance wider{Rows(rows)};
    const Seconds tolerance = wider.in_time(options.row_time);
    if (tolerance <= asked || tolerance >= options.period / 2) continue;
    const AlignEffort effort = foretell(prospect, options.policy, tolerance, options);
    if (!within_limits(effort, options)) continue;
    offers.push_back({options.policy, wider, effort});
    break;
  }
  return offers;
}

}  // namespace emberlock::smear
