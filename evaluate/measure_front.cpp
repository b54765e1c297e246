// SPDX-License-Identifier: Apache-2.0
#include "evaluate/measure_front.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "evaluate/recon_sweep.h"
#include "recon/adjust/picture_error.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/pipeline/reference_run.h"
#include "recon/synthetic/flame.h"

namespace emberlock::evaluate {
namespace {

constexpr int kRepeats = 3;  // of a reference, the quickest counts: it is over in a moment

/// The quickest of several.
Result<recon::Reference> time_reference(const recon::Scene& scene, int voxels,
                                        const recon::ComputeOptions& compute, const recon::Elapsed& elapsed) {
  recon::SolveOptions options;
  options.compute = compute;
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::PreparedScene prepared, recon::PreparedScene::create(scene, {}));
  recon::Reference best;
  for (int i = 0; i < kRepeats; ++i) {
    EMBERLOCK_ASSIGN_OR_RETURN(
        recon::Reference again,
        recon::measure_reference(prepared, recon::grid_over(scene.box, voxels), options, elapsed));
    if (i == 0 || again.seconds < best.seconds) best = std::move(again);
  }
  return best;
}

/// Fills `ends` and `solves`.
Status measure_ends(const recon::Scene& scene, const std::vector<int>& voxels,
                    const recon::ComputeOptions& compute, const Clock& clock, const Progress& progress,
                    MeasuredFront& measured) {
  std::vector<recon::WorkPoint>& ends = measured.ends;
  for (const char* effects : {"auto", "none"})
    for (const int v : voxels) {
      recon::ReconstructOptions options;
      options.voxels = v;
      options.solve.compute = compute;
      EMBERLOCK_ASSIGN_OR_RETURN(options.effects, recon::parse_effects(effects));
      tell(progress, static_cast<double>(ends.size()) / static_cast<double>(2 * voxels.size()),
           fmt::format("{} voxels, effects {}, to the solver's end", v, effects));
      EMBERLOCK_ASSIGN_OR_RETURN(const recon::Outcome outcome, recon::reconstruct(scene, options, clock));
      const recon::Report& done = outcome.report;
      ends.push_back({{.voxels = v, .iterations = 0, .effects = effects},
                      done.total_time.value(),
                      recon::all_channels(done.heldout_rmse.value())});
      measured.solves.push_back(ends.back());
      measured.solves.back().seconds -= done.effects_time.value();
    }
  return {};
}

/// The geometric mean of two flames' points, as source; those that one of them lacks are left out.
std::string rows_of(const std::vector<recon::WorkPoint>& of_one,
                    const std::vector<recon::WorkPoint>& of_other) {
  std::string source;
  for (const recon::WorkPoint& a : of_one) {
    const auto b = std::find_if(of_other.begin(), of_other.end(),
                                [&](const recon::WorkPoint& p) { return p.settings == a.settings; });
    if (b == of_other.end()) continue;
    source +=
        fmt::format("    {{{}, {}, \"{}\", {:.4g}, {:.4g}}},\n", a.settings.voxels, a.settings.iterations,
                    a.settings.effects, std::sqrt(a.seconds * b->seconds), std::sqrt(a.error * b->error));
  }
  return source;
}

}  // namespace

Result<MeasuredFront> measure_front(const recon::Scene& scene, const recon::ComputeOptions& compute,
                                    const Clock& clock, const Progress& progress) {
  const TimePoint start = clock.now();
  const recon::Elapsed elapsed = [&] { return clock.now() - start; };
  const int finest = recon::finest_voxels(scene);
  MeasuredFront measured;
  recon::Reference reference;
  for (int voxels = recon::reference_voxels(finest); voxels <= finest; voxels *= 2) {
    EMBERLOCK_ASSIGN_OR_RETURN(recon::Reference run, time_reference(scene, voxels, compute, elapsed));
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
  EMBERLOCK_RETURN_IF_ERROR(measure_ends(scene, options.voxels, compute, clock, half(0.5), measured));
  const double seconds = std::max(reference.seconds.value(), 1e-9);
  for (recon::CalibrationRun& run : measured.calibration) run.seconds /= seconds;
  for (auto* points : {&measured.points, &measured.ends, &measured.solves})
    for (recon::WorkPoint& p : *points) {
      p.seconds /= seconds;
      p.error /= std::max(reference.error, 1e-9);
    }
  return measured;
}

Result<std::string> reference_front_source(const recon::ComputeOptions& compute, const Clock& clock,
                                           const Progress& progress) {
  std::vector<MeasuredFront> fronts;
  int finest = 0;
  for (const recon::FlameShape shape : {recon::FlameShape::plume, recon::FlameShape::two_plumes}) {
    const double from = 0.5 * static_cast<double>(fronts.size());
    recon::PaperSceneOptions options;
    options.flame.shape = shape;
    const recon::Scene scene = recon::paper_scene(options);
    finest = recon::finest_voxels(scene);
    EMBERLOCK_ASSIGN_OR_RETURN(MeasuredFront front,
                               measure_front(scene, compute, clock, [&](double f, std::string_view words) {
                                 tell(progress, from + 0.5 * f, words);
                               }));
    fronts.push_back(std::move(front));
  }
  std::string source = fmt::format(
      "// Remade by `emberlock tradeoff recon --ship recon/pipeline/reference_front.inc`; reference_front.h "
      "says "
      "what it holds.\n"
      "constexpr int kFinest = {};\n"
      "// voxels, iterations, effects, seconds, error\n"
      "constexpr Row kRows[] = {{\n{}}};\n"
      "constexpr Row kEnds[] = {{\n{}}};\n"
      "constexpr Row kSolves[] = {{\n{}}};\n"
      "// voxels, seconds\n"
      "constexpr CalibrationRun kCalibration[] = {{\n",
      finest, rows_of(fronts[0].points, fronts[1].points), rows_of(fronts[0].ends, fronts[1].ends),
      rows_of(fronts[0].solves, fronts[1].solves));
  for (std::size_t i = 0; i < fronts[0].calibration.size(); ++i) {
    const recon::CalibrationRun& run = fronts[0].calibration[i];
    source += fmt::format("    {{{}, {:.4g}}},\n", run.voxels,
                          std::sqrt(run.seconds * fronts[1].calibration[i].seconds));
  }
  return source + "};\n";
}

}  // namespace emberlock::evaluate
