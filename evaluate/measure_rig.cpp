// SPDX-License-Identifier: Apache-2.0
#include "evaluate/measure_rig.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "evaluate/filmed_rig.h"
#include "evaluate/option_range.h"
#include "evaluate/sync_tradeoff.h"
#include "recon/effects/effects.h"

namespace emberlock::evaluate {
namespace {

constexpr int kMostTries = 5;    // set-ups picked by prediction that may prove not to be what they seemed
constexpr int kMostReviews = 3;  // of choosing and looking around
constexpr std::size_t kLikelyChecks = 12;
constexpr std::size_t kFrontChecks = 3;
constexpr std::size_t kMostSetups = 200'000;
constexpr double kAboveBest = 1.25;   // the target where none is asked for
constexpr double kAlignShare = 0.05;  // of the progress

Error refused(const std::string& what, const char* option, const std::string& remedy) {
  return {ErrorKind::bad_input, what, option, remedy};
}

/// 1 to 16 values in range, each above the one before.
template <class List, class Number>
Status ascending(const char* option, const List& list, double low, double high, Number number) {
  if (list.empty() || list.size() > 16)
    return refused(fmt::format("has {} values", list.size()), option, "give 1 to 16");
  for (std::size_t i = 0; i < list.size(); ++i) {
    EMBERLOCK_RETURN_IF_ERROR(in_range(option, number(list[i]), low, high));
    if (i > 0 && !(number(list[i]) > number(list[i - 1])))
      return refused(fmt::format("{:g} stands after {:g}", number(list[i]), number(list[i - 1])), option,
                     "give each value once, the smallest first");
  }
  return {};
}

Status check(const RigTradeoffOptions& o) {
  const auto itself = [](auto value) { return static_cast<double>(value); };
  const auto width = [](ImageSize size) { return static_cast<double>(size.width); };
  EMBERLOCK_RETURN_IF_ERROR(in_range("--flame-speed", o.flame_speed, 0, 100));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--flame-size", o.flame_size.value(), 1e-3, 100));
  EMBERLOCK_RETURN_IF_ERROR(ascending("--cameras", o.cameras, 3, 32, itself));
  EMBERLOCK_RETURN_IF_ERROR(ascending("--sizes", o.images, 32, 2048, width));
  for (const ImageSize size : o.images)
    EMBERLOCK_RETURN_IF_ERROR(in_range("--sizes, height", size.height, 24, 2048));
  EMBERLOCK_RETURN_IF_ERROR(ascending("--voxels", o.voxels, 8, 192, itself));
  EMBERLOCK_RETURN_IF_ERROR(ascending("--exposures", o.exposures, 0.01, 100, in_milliseconds));
  EMBERLOCK_RETURN_IF_ERROR(ascending("--tolerances", o.tolerances, 0.03, 20, in_milliseconds));
  if (o.effects.empty() || o.policies.empty())
    return refused("is empty", o.effects.empty() ? "--effects" : "--policies", "give one or more");
  for (const std::string& effects : o.effects)
    if (const auto request = recon::parse_effects(effects); !request) return request.error();
  EMBERLOCK_RETURN_IF_ERROR(in_range("--reset-seconds", o.reset_time.value(), 0, 3600));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--camera-price", o.camera_price, 0, 1e6));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--noise", o.noise, 0, 50));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--frames", o.frames, 1, 1e7));
  if (o.target) EMBERLOCK_RETURN_IF_ERROR(in_range("--target", *o.target, 1e-3, 255));
  return in_range("--rigs", o.rigs, 20, 100000);
}

/// The devices asked for, or all that this machine has.
Result<std::vector<recon::Device>> usable(const std::vector<recon::Device>& asked) {
  std::vector<recon::Device> devices;
  for (const recon::Device device : asked) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Device resolved, recon::resolve(device));
    if (std::find(devices.begin(), devices.end(), resolved) == devices.end()) devices.push_back(resolved);
  }
  if (!asked.empty()) return devices;
  devices.push_back(recon::Device::cpu);
  if (recon::resolve(recon::Device::cuda)) devices.push_back(recon::Device::cuda);
  return devices;
}

/// Minutes of the quickest policy.
Result<std::vector<double>> align_minutes(const RigTradeoffOptions& o, int cameras) {
  SyncTradeoffOptions sync;
  for (const Seconds tolerance : o.tolerances) sync.tolerances.push_back(tolerance / sync.row_time);
  sync.policies = o.policies;
  sync.cameras = cameras;
  sync.reset_time = o.reset_time;
  sync.rigs = o.rigs;
  sync.seed = o.seed;
  sync.flame_speed = 0;
  sync.threads = o.threads;
  EMBERLOCK_ASSIGN_OR_RETURN(const SyncTradeoff measured, measure_sync_tradeoff(sync));
  std::vector<double> minutes;
  for (const Rows tolerance : measured.options.tolerances) {
    const SyncCost* cost = cheapest(measured, tolerance);
    minutes.push_back(cost != nullptr ? cost->statistics.seconds / 60
                                      : std::numeric_limits<double>::infinity());
  }
  return minutes;
}

/// The middle of what is measured in steps; of time, what disturbs least.
RigGrid grid_of(const RigTradeoffOptions& o) {
  RigGrid grid;
  grid.counts = {o.cameras.size(),   o.images.size(),     o.voxels.size(), o.effects.size(),
                 o.exposures.size(), o.tolerances.size(), o.devices.size()};
  grid.base.choice = {o.cameras.size() / 2, (o.images.size() - 1) / 2, o.voxels.size() / 2, 0, 0, 0, 0};
  grid.base.choice[static_cast<std::size_t>(RigAxis::effects)] = o.effects.size() - 1;
  for (const int cameras : o.cameras) grid.euros.push_back(cameras * o.camera_price);
  grid.frames = o.frames;
  return grid;
}

/// Simulates set-ups as they are asked for.
class RigSimulator {
 public:
  RigSimulator(RigTradeoff& result, const Clock& clock, const Progress& progress, std::size_t expected)
      : result_(result),
        clock_(clock),
        progress_(progress),
        start_(clock.now()),
        expected_(expected),
        flame_(result.options) {}

  Status simulate(const RigSetup& setup) {
    if (result_.frames.contains(setup)) return {};
    say(setup);
    EMBERLOCK_ASSIGN_OR_RETURN(const RigFrame frame, flame_.reconstruct(setup, clock_));
    result_.frames[setup] = frame;
    return {};
  }

  /// The first run takes longer: its time would be the base's.
  Status warm_up() {
    say(result_.grid.base);
    EMBERLOCK_ASSIGN_OR_RETURN(const RigFrame unused, flame_.reconstruct(result_.grid.base, clock_));
    static_cast<void>(unused);
    return {};
  }

  /// The same of a joint set-up, which tells how good its prediction was.
  Status verify(const RigSetup& setup) {
    if (result_.frames.contains(setup)) return {};
    const RigFrame predicted = predict(result_.grid, result_.frames, setup);
    EMBERLOCK_RETURN_IF_ERROR(simulate(setup));
    result_.checks.push_back({setup, predicted, result_.frames.at(setup)});
    return {};
  }

  /// Joins, picks and simulates the pick, until it was simulated before or too many weren't what they seemed.
  template <class Pick>
  Status settle(Pick pick) {
    for (int tries = 0;; ++tries) {
      result_.points = join(result_.grid, result_.frames);
      const std::optional<std::size_t> at = pick(result_.points);
      if (tries == kMostTries || !at || result_.points[*at].source == RigPoint::Source::simulated) return {};
      EMBERLOCK_RETURN_IF_ERROR(verify(result_.points[*at].setup));
    }
  }

 private:
  void say(const RigSetup& setup) const {
    const auto done = static_cast<double>(result_.frames.size());
    const double all = std::max(static_cast<double>(expected_), done + 1);
    std::string words = setup_text(result_.options, setup);
    if (done > 0)
      words += fmt::format("; about {:.0f} s left", (clock_.now() - start_).value() / done * (all - done));
    tell(progress_, kAlignShare + (1 - kAlignShare) * done / all, words);
  }

  RigTradeoff& result_;
  const Clock& clock_;
  const Progress& progress_;
  TimePoint start_;
  std::size_t expected_;
  FilmedRig flame_;
};

Status measure_alignments(RigTradeoff& result, const Progress& progress) {
  for (const int cameras : result.options.cameras) {
    const auto done = static_cast<double>(result.grid.align_minutes.size());
    tell(progress, kAlignShare * done / static_cast<double>(result.options.cameras.size()),
         fmt::format("aligning {} cameras", cameras));
    EMBERLOCK_ASSIGN_OR_RETURN(std::vector<double> minutes, align_minutes(result.options, cameras));
    result.grid.align_minutes.push_back(std::move(minutes));
  }
  for (const std::vector<double>& minutes : result.grid.align_minutes)
    if (std::any_of(minutes.begin(), minutes.end(), [](double m) { return std::isfinite(m); })) return {};
  return Error{ErrorKind::not_converged, "no policy reaches any tolerance in 95 rigs of 100", "--tolerances",
               "give larger ones, or other --policies"};
}

/// Some that are only predicted, spread over the front.
Status verify_front(RigTradeoff& result, RigSimulator& simulator) {
  std::vector<RigSetup> joined;
  for (const std::size_t i : pareto_front(result.points))
    if (result.points[i].source == RigPoint::Source::joined) joined.push_back(result.points[i].setup);
  const std::size_t checks = std::min(kFrontChecks, joined.size());
  for (std::size_t i = 0; i < checks; ++i)
    EMBERLOCK_RETURN_IF_ERROR(simulator.verify(joined[(2 * i + 1) * joined.size() / (2 * checks)]));
  return {};
}

/// The points, of which only the simulated ones can be picked.
std::vector<RigPoint> only_simulated(std::vector<RigPoint> points) {
  for (RigPoint& point : points)
    if (point.source == RigPoint::Source::joined) point.frame.error = std::numeric_limits<double>::infinity();
  return points;
}

/// Fills best, target, chosen and steps of the points as they are.
void conclude(RigTradeoff& result) {
  result.points = join(result.grid, result.frames);
  result.front = pareto_front(result.points);
  const std::vector<RigPoint> simulated = only_simulated(result.points);
  result.best = *most_accurate(simulated);
  if (!result.options.target) result.options.target = kAboveBest * result.points[result.best].frame.error;
  result.chosen = cheapest(simulated, *result.options.target);
  result.steps = next_steps(result.grid, result.points, result.chosen.value_or(result.best));
}

/// Simulates the choice and the steps from it, which can show a better choice.
Status choose(RigTradeoff& result, RigSimulator& simulator) {
  EMBERLOCK_RETURN_IF_ERROR(simulator.settle(most_accurate));
  conclude(result);
  for (int round = 0; round < kMostReviews; ++round) {
    EMBERLOCK_RETURN_IF_ERROR(simulator.settle(
        [&](const std::vector<RigPoint>& points) { return cheapest(points, *result.options.target); }));
    conclude(result);
    const std::size_t before = result.frames.size();
    const RigSetup here = result.points[result.chosen.value_or(result.best)].setup;
    const double seen_here = predict(result.grid, result.frames, here).error;
    for (const RigSetup& setup : neighbours(result.grid, here))
      if (predict(result.grid, result.frames, setup).error <= seen_here)
        EMBERLOCK_RETURN_IF_ERROR(simulator.verify(setup));
    conclude(result);
    if (result.frames.size() == before) return {};
  }
  return {};
}

}  // namespace

Result<RigTradeoff> measure_rig_tradeoff(const RigTradeoffOptions& asked, const Clock& clock,
                                         const Progress& progress) {
  EMBERLOCK_RETURN_IF_ERROR(check(asked));
  const TimePoint start = clock.now();
  RigTradeoff result;
  result.options = asked;
  EMBERLOCK_ASSIGN_OR_RETURN(result.options.devices, usable(asked.devices));
  result.grid = grid_of(result.options);
  double setups = 1;
  for (const std::size_t count : result.grid.counts) setups *= static_cast<double>(count);
  if (setups > kMostSetups)
    return refused(fmt::format("asks for {:g} set-ups", setups), "tradeoff rig",
                   fmt::format("give shorter lists: at most {} combinations", kMostSetups));
  EMBERLOCK_RETURN_IF_ERROR(measure_alignments(result, progress));
  const std::vector<RigSetup> axes = along_axes(result.grid);
  RigSimulator simulator(result, clock, progress, axes.size() + kLikelyChecks);
  EMBERLOCK_RETURN_IF_ERROR(simulator.warm_up());
  for (const RigSetup& setup : axes) EMBERLOCK_RETURN_IF_ERROR(simulator.simulate(setup));
  result.points = join(result.grid, result.frames);
  EMBERLOCK_RETURN_IF_ERROR(verify_front(result, simulator));
  EMBERLOCK_RETURN_IF_ERROR(choose(result, simulator));
  result.took = clock.now() - start;
  tell(progress, 1, "done");
  return result;
}

std::string choice_text(const RigTradeoffOptions& o, RigAxis axis, std::size_t i) {
  switch (axis) {
    case RigAxis::cameras:
      return fmt::format("{} cameras", o.cameras[i]);
    case RigAxis::image:
      return fmt::format("{}x{}", o.images[i].width, o.images[i].height);
    case RigAxis::voxels:
      return fmt::format("{} voxels", o.voxels[i]);
    case RigAxis::effects:
      return "effects " + o.effects[i];
    case RigAxis::exposure:
      return fmt::format("{:g} ms exposure", in_milliseconds(o.exposures[i]));
    case RigAxis::tolerance:
      return fmt::format("within {:g} ms", in_milliseconds(o.tolerances[i]));
    case RigAxis::device:
      return recon::name(o.devices[i]);
  }
  return {};
}

std::string setup_text(const RigTradeoffOptions& o, const RigSetup& setup) {
  std::string words;
  for (const RigAxis axis : kAllRigAxes) {
    if (axis == RigAxis::device && o.devices.size() == 1) continue;
    words += (words.empty() ? "" : ", ") + choice_text(o, axis, setup.at(axis));
  }
  return words;
}

}  // namespace emberlock::evaluate
