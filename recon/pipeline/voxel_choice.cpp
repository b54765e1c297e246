// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/voxel_choice.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reference_front.h"
#include "recon/pipeline/reference_run.h"

namespace emberlock::recon {
namespace {

constexpr Seconds kMostCalibration{1};  // what would take longer isn't begun; the first run always is
constexpr double kFinerCosts = 4;       // times a coarse solve on a grid twice as fine takes, about

/// The finer of two runs beside the other one, in words.
std::string lower_by(const WorkPoint& now, const WorkPoint& then) {
  return fmt::format("lower the error by about {:.1f} %", 100 * (1 - then.error / now.error));
}

/// The quickest run that is finer and reaches less than `chosen`; nullptr where nothing does.
const WorkPoint* next_better(const std::vector<WorkPoint>& points, const WorkPoint& chosen) {
  const WorkPoint* next = nullptr;
  for (const WorkPoint& p : points)
    if (p.settings.voxels > chosen.settings.voxels && p.error < chosen.error &&
        (next == nullptr || p.seconds < next->seconds))
      next = &p;
  return next;
}

/// Of a chosen run where the search for effects finds that the flame takes no light.
double seconds_without_effects(const Scene& scene, int voxels, Seconds unit) {
  const auto seconds = [&](const std::vector<WorkPoint>& runs, const char* effects) {
    return unit.value() * seconds_at(runs, effects, finest_voxels(scene), voxels);
  };
  return seconds(reference_ends(), "auto") - seconds(reference_solves(), "auto") +
         seconds(reference_solves(), "none");
}

/// `spent`: seconds that have passed already. `least`: what it takes where an effect is not called for.
std::string why(const std::vector<WorkPoint>& points, const WorkPoint& chosen, const Calibration& measured,
                double spent, double least) {
  const double most = spent + chosen.seconds;
  std::string words = fmt::format("{} voxels along the longest edge: about ", chosen.settings.voxels);
  words += least < chosen.seconds
               ? fmt::format("{:.2g} s, or {:.2g} where the flame takes none of its own light,", most,
                             spent + least)
               : fmt::format("{:.2g} s", most);
  words += fmt::format(" from the loaded pictures on, on this machine as it is now (measured in {:.2g} s)",
                       measured.took.value());
  Patience unhurried;
  unhurried.most_seconds = INFINITY;
  const WorkPoint& wanted = *knee(points, unhurried);
  if (wanted.settings.voxels > chosen.settings.voxels) {
    return words + fmt::format(
                       ", which is slow or busy: {} voxels would {} but take about {:.2g} s, and no more "
                       "than {:.2g} s "
                       "are spent unasked",
                       wanted.settings.voxels, lower_by(chosen, wanted), spent + wanted.seconds,
                       Patience{}.most_seconds);
  }
  if (const WorkPoint* next = next_better(points, chosen)) {
    return words + fmt::format("; the knee: {} voxels would {} and take about {:.2g} s more",
                               next->settings.voxels, lower_by(chosen, *next),
                               next->seconds - chosen.seconds);
  }
  return words + "; no finer grid lowers the error by the reference front";
}

std::string what_else(const std::vector<VoxelChoice::Option>& options, const VoxelChoice& choice) {
  std::string words = "ask for others with";
  for (const auto& option : options)
    words += fmt::format(" --voxels {} (about {:.2g} s),", option.voxels, option.time.value());
  return words +
         fmt::format(
             " --voxels paper ({}), --budget SECONDS or --target-rmse LEVELS; --voxels {} repeats this run",
             choice.by_the_paper, choice.voxels);
}

VoxelChoice told(const Scene& scene, const char* rule, int voxels, std::string words) {
  VoxelChoice choice;
  choice.rule = rule;
  choice.voxels = voxels;
  choice.by_the_paper = voxels_by_the_paper(scene);
  if (!words.empty()) choice.words.push_back(std::move(words));
  return choice;
}

}  // namespace

Result<Calibration> calibrate(const Task& task, const ReconstructOptions& options) {
  const int finest = finest_voxels(task.scene());
  const PreparedScene scene = task.prepared.under(told_effects(options));
  SolveOptions coarse = options.solve;
  coarse.iterations = 0;
  coarse.budget.reset();  // a run that is cut short would make the machine seem quicker than it is
  coarse.stop = {};
  const Seconds start = task.elapsed();
  Calibration result;
  double finer = 1;  // times the reference's voxels
  for (int run = 0;; ++run) {
    const int voxels = static_cast<int>(finer * reference_voxels(finest));
    const Grid grid = grid_over(scene.told().box, voxels);
    const Seconds begin = task.elapsed();
    EMBERLOCK_ASSIGN_OR_RETURN(const Reference measured,
                               measure_reference(scene, grid, coarse, task.elapsed));
    const Seconds last = task.elapsed() - begin;
    const auto step = static_cast<std::size_t>(std::lround(std::log2(finer)));
    result.unit = measured.seconds / reference_calibration()[step].seconds;
    result.took = task.elapsed() - start;
    const bool repeat = run == 0;
    if (!repeat && (step + 1 == reference_calibration().size() || 2 * voxels > finest)) return result;
    if (result.took + (repeat ? 1.0 : kFinerCosts) * last > kMostCalibration) return result;
    if (!repeat) finer *= 2;
  }
}

std::vector<WorkPoint> expected_runs(const Scene& scene, const ReconstructOptions& options,
                                     const Calibration& calibration) {
  const bool fixed = options.effects && options.effects->fixed;
  const int limit = options.solve.iterations;
  // Up to the solver's own end, or to the front's last iteration within a limit.
  std::vector<WorkPoint> runs = reference_ends();
  if (limit > 0) {
    for (WorkPoint& run : runs) {
      const double end = run.seconds;
      for (const WorkPoint& p : reference_front())
        if (p.settings.voxels == run.settings.voxels && p.settings.effects == run.settings.effects &&
            p.settings.iterations <= limit)
          run = {run.settings, std::min(end, p.seconds), p.error};
    }
  }
  // The front's flames take light: what leaves that out has a model that doesn't fit, and its errors say
  // nothing of the voxels. So effects that are set by hand have their own time, and the error of the others.
  std::vector<WorkPoint> expected;
  for (const WorkPoint& run : runs) {
    if (run.settings.effects != "auto") continue;
    WorkPoint point = run;
    if (fixed) {
      for (const WorkPoint& p : runs)
        if (p.settings.voxels == run.settings.voxels && p.settings.effects == "none")
          point.seconds = p.seconds;
    }
    expected.push_back(point);
  }
  expected = scaled(std::move(expected), finest_voxels(scene), std::max(1e-9, calibration.unit.value()), 1);
  if (options.voxels) return at_voxels(expected, *options.voxels);
  std::erase_if(expected,
                [&](const WorkPoint& p) { return !choose_grid(scene, options, p.settings.voxels).ok(); });
  return expected;
}

Result<VoxelChoice> choose_voxels(const Task& task, const ReconstructOptions& options,
                                  const Progress& progress) {
  const Scene& scene = task.scene();
  if (options.voxels) return told(scene, "asked", *options.voxels, "");
  if (options.rule == VoxelRule::paper) {
    const int voxels = voxels_by_the_paper(scene);
    return told(
        scene, "paper", voxels,
        fmt::format("{} voxels along the longest edge: two for three pixels, the paper's rule", voxels));
  }
  if (options.solve.solver != Solver::standard) {
    const int voxels = finest_voxels(scene);
    return told(
        scene, "finest", voxels,
        fmt::format(
            "{} voxels along the longest edge: two for three pixels, at most {} ({} by --voxels paper)",
            voxels, kLargestChosenVoxels, voxels_by_the_paper(scene)));
  }
  tell(progress, 0, "measuring this machine on coarse grids");
  const auto calibrated = calibrate(task, options);
  if (!calibrated) {  // a coarse run without effects is a yardstick alone: the real one may do
    const int voxels = finest_voxels(scene);
    return told(scene, "finest", voxels,
                fmt::format("{} voxels along the longest edge, as this machine couldn't be measured: {}",
                            voxels, calibrated.error().message()));
  }
  const Calibration& measured = *calibrated;
  const std::vector<WorkPoint> points = expected_runs(scene, options, measured);
  const WorkPoint* chosen = knee(points);
  if (chosen == nullptr) return told(scene, "finest", finest_voxels(scene), "");  // choose_grid() says why
  const Seconds spent = task.elapsed();
  const bool searches = !options.effects || !options.effects->fixed;
  const double least = searches && options.solve.iterations == 0
                           ? seconds_without_effects(scene, chosen->settings.voxels, measured.unit)
                           : chosen->seconds;
  VoxelChoice choice =
      told(scene, "knee", chosen->settings.voxels, why(points, *chosen, measured, spent.value(), least));
  choice.calibration_time = measured.took;
  choice.expected_time = spent + Seconds(chosen->seconds);
  for (const WorkPoint& p : points) {
    if (&p == chosen) continue;
    choice.options.push_back({p.settings.voxels, spent + Seconds(p.seconds), p.error / chosen->error});
  }
  choice.words.push_back(what_else(choice.options, choice));
  return choice;
}

}  // namespace emberlock::recon
