// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/shipped_front.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/pipeline/reference_run.h"
#include "recon/pipeline/sweep.h"
#include "recon/preprocess/flame_mask.h"
#include "recon/synthetic/flame.h"

namespace emberlock::recon {
namespace {

struct Row {
  int voxels;
  int iterations;
  const char* effects;
  double seconds;
  double error;
};

#include "recon/pipeline/shipped_front.inc"

constexpr int kRepeats = 3;  // of a reference, the quickest counts: it is over in a moment

std::vector<WorkPoint> points_of(const Row* begin, const Row* end) {
  std::vector<WorkPoint> points;
  for (const Row* row = begin; row != end; ++row) {
    points.push_back({{.voxels = row->voxels, .iterations = row->iterations, .effects = row->effects},
                      row->seconds,
                      row->error});
  }
  return points;
}

/// The quickest of several.
Result<Reference> time_reference(const Scene& scene, int voxels, const ComputeOptions& compute,
                                 const Elapsed& elapsed) {
  SolveOptions options;
  options.compute = compute;
  Reference best;
  for (int i = 0; i < kRepeats; ++i) {
    EMBERLOCK_ASSIGN_OR_RETURN(Reference again,
                               measure_reference(scene, grid_over(scene.box, voxels), {}, options, elapsed));
    if (i == 0 || again.seconds < best.seconds) best = std::move(again);
  }
  return best;
}

/// Runs to the solver's own end.
Result<std::vector<WorkPoint>> measure_ends(const Scene& scene, const std::vector<int>& voxels,
                                            const ComputeOptions& compute, const Clock& clock,
                                            const Progress& progress) {
  std::vector<WorkPoint> ends;
  for (const char* effects : {"auto", "none"})
    for (const int v : voxels) {
      ReconstructOptions options;
      options.voxels = v;
      options.solve.compute = compute;
      EMBERLOCK_ASSIGN_OR_RETURN(options.effects, parse_effects(effects));
      tell(progress, static_cast<double>(ends.size()) / static_cast<double>(2 * voxels.size()),
           fmt::format("{} voxels, effects {}, to the solver's end", v, effects));
      EMBERLOCK_ASSIGN_OR_RETURN(const Outcome outcome, reconstruct(scene, options, clock));
      const Report& done = outcome.report;
      ends.push_back({{.voxels = v, .iterations = 0, .effects = effects},
                      done.total_time.value(),
                      all_channels(done.heldout_rmse.value())});
    }
  return ends;
}

/// The geometric mean of two flames' points, as source; those that one of them lacks are left out.
std::string rows_of(const std::vector<WorkPoint>& of_one, const std::vector<WorkPoint>& of_other) {
  std::string source;
  for (const WorkPoint& a : of_one) {
    const auto b = std::find_if(of_other.begin(), of_other.end(),
                                [&](const WorkPoint& p) { return p.settings == a.settings; });
    if (b == of_other.end()) continue;
    source +=
        fmt::format("    {{{}, {}, \"{}\", {:.4g}, {:.4g}}},\n", a.settings.voxels, a.settings.iterations,
                    a.settings.effects, std::sqrt(a.seconds * b->seconds), std::sqrt(a.error * b->error));
  }
  return source;
}

}  // namespace

int shipped_finest() { return kFinest; }

const std::vector<WorkPoint>& shipped_front() {
  static const std::vector<WorkPoint> front = points_of(std::begin(kRows), std::end(kRows));
  return front;
}

const std::vector<WorkPoint>& shipped_ends() {
  static const std::vector<WorkPoint> ends = points_of(std::begin(kEnds), std::end(kEnds));
  return ends;
}

const std::vector<CalibrationRun>& shipped_calibration() {
  static const std::vector<CalibrationRun> runs(std::begin(kCalibration), std::end(kCalibration));
  return runs;
}

std::vector<WorkPoint> scaled(std::vector<WorkPoint> front, int finest, double reference_seconds,
                              double reference_error) {
  for (WorkPoint& p : front) {
    p.settings.voxels =
        std::max(1, static_cast<int>(std::lround(static_cast<double>(p.settings.voxels) * finest / kFinest)));
    p.seconds *= reference_seconds;
    p.error *= reference_error;
  }
  return front;
}

Result<MeasuredFront> measure_front(const Scene& scene, const ComputeOptions& compute, const Clock& clock,
                                    const Progress& progress) {
  const TimePoint start = clock.now();
  const Elapsed elapsed = [&] { return clock.now() - start; };
  const int finest = finest_voxels(scene);
  MeasuredFront measured;
  Reference reference;
  for (int voxels = reference_voxels(finest); voxels <= finest; voxels *= 2) {
    EMBERLOCK_ASSIGN_OR_RETURN(Reference run, time_reference(scene, voxels, compute, elapsed));
    measured.calibration.push_back({voxels, run.seconds.value()});
    if (measured.calibration.size() == 1) reference = std::move(run);
  }
  SweepOptions options;
  for (const int eighths : {1, 2, 3, 4, 6, 8}) options.voxels.push_back(finest * eighths / 8);
  options.iterations = {1, 2, 4, 8, 12};
  options.one_at_a_time = false;
  options.compute = compute;
  const auto half = [&](double from) {
    return [&progress, from](double f, std::string_view words) { tell(progress, from + 0.5 * f, words); };
  };
  EMBERLOCK_ASSIGN_OR_RETURN(Sweep result, sweep(scene, options, clock, half(0)));
  measured.points = std::move(result.points);
  EMBERLOCK_ASSIGN_OR_RETURN(measured.ends, measure_ends(scene, options.voxels, compute, clock, half(0.5)));
  const double seconds = std::max(reference.seconds.value(), 1e-9);
  for (CalibrationRun& run : measured.calibration) run.seconds /= seconds;
  for (auto* points : {&measured.points, &measured.ends})
    for (WorkPoint& p : *points) {
      p.seconds /= seconds;
      p.error /= std::max(reference.error, 1e-9);
    }
  return measured;
}

Result<std::string> measure_shipped_source(const ComputeOptions& compute, const Clock& clock,
                                           const Progress& progress) {
  std::vector<MeasuredFront> fronts;
  int finest = 0;
  for (const FlameShape shape : {FlameShape::plume, FlameShape::two_plumes}) {
    const double from = 0.5 * static_cast<double>(fronts.size());
    PaperSceneOptions options;
    options.flame.shape = shape;
    const Scene scene = paper_scene(options);
    finest = finest_voxels(scene);
    EMBERLOCK_ASSIGN_OR_RETURN(MeasuredFront front,
                               measure_front(scene, compute, clock, [&](double f, std::string_view words) {
                                 tell(progress, from + 0.5 * f, words);
                               }));
    fronts.push_back(std::move(front));
  }
  std::string source = fmt::format(
      "// Remade by `emberlock tradeoff recon --ship recon/pipeline/shipped_front.inc`; shipped_front.h says "
      "what it holds.\n"
      "constexpr int kFinest = {};\n"
      "// voxels, iterations, effects, seconds, error\n"
      "constexpr Row kRows[] = {{\n{}}};\n"
      "constexpr Row kEnds[] = {{\n{}}};\n"
      "// voxels, seconds\n"
      "constexpr CalibrationRun kCalibration[] = {{\n",
      finest, rows_of(fronts[0].points, fronts[1].points), rows_of(fronts[0].ends, fronts[1].ends));
  for (std::size_t i = 0; i < fronts[0].calibration.size(); ++i) {
    const CalibrationRun& run = fronts[0].calibration[i];
    source += fmt::format("    {{{}, {:.4g}}},\n", run.voxels,
                          std::sqrt(run.seconds * fronts[1].calibration[i].seconds));
  }
  return source + "};\n";
}

}  // namespace emberlock::recon
