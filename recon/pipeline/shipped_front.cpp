#include "recon/pipeline/shipped_front.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reference_run.h"
#include "recon/pipeline/sweep.h"
#include "recon/synthetic/flame.h"

namespace emberlock {
namespace {

struct Row {
  int voxels;
  int iterations;
  const char* effects;
  double seconds;
  double error;
};

#include "recon/pipeline/shipped_front.inc"

constexpr int kRepeats = 3;  // of the reference, the quickest counts: it is over in a moment

}  // namespace

int shipped_finest() { return kFinest; }

const std::vector<WorkPoint>& shipped_front() {
  static const std::vector<WorkPoint> front = [] {
    std::vector<WorkPoint> points;
    for (const Row& row : kRows) {
      points.push_back({{.voxels = row.voxels, .iterations = row.iterations, .effects = row.effects},
                        row.seconds,
                        row.error});
    }
    return points;
  }();
  return front;
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

Result<std::vector<WorkPoint>> measure_front(const Scene& scene, const ComputeOptions& compute,
                                             const Clock& clock, const Progress& progress) {
  const TimePoint start = clock.now();
  const Elapsed elapsed = [&] { return clock.now() - start; };
  const int finest = voxels_by_the_paper(scene);
  const Grid coarse = grid_over(scene.box, reference_voxels(finest));
  SolveOptions solve_options;
  solve_options.compute = compute;
  double seconds = INFINITY;
  double error = 0;
  for (int i = 0; i < kRepeats; ++i) {
    EMBERLOCK_ASSIGN_OR_RETURN(const Reference reference,
                               measure_reference(scene, coarse, {}, solve_options, elapsed));
    seconds = std::min(seconds, reference.seconds.value());
    error = reference.error;
  }
  SweepOptions options;
  for (const int eighths : {1, 2, 3, 4, 6, 8}) options.voxels.push_back(finest * eighths / 8);
  options.iterations = {1, 2, 4, 8, 12};
  options.one_at_a_time = false;
  options.compute = compute;
  EMBERLOCK_ASSIGN_OR_RETURN(Sweep result, sweep(scene, options, clock, progress));
  for (WorkPoint& p : result.points) {
    p.seconds /= std::max(seconds, 1e-9);
    p.error /= std::max(error, 1e-9);
  }
  return std::move(result.points);
}

Result<std::string> measure_shipped_source(const ComputeOptions& compute, const Clock& clock,
                                           const Progress& progress) {
  std::vector<std::vector<WorkPoint>> fronts;
  int finest = 0;
  for (const FlameShape shape : {FlameShape::plume, FlameShape::two_plumes}) {
    const double from = 0.5 * static_cast<double>(fronts.size());
    PaperSceneOptions options;
    options.flame.shape = shape;
    const Scene scene = paper_scene(options);
    finest = voxels_by_the_paper(scene);
    EMBERLOCK_ASSIGN_OR_RETURN(std::vector<WorkPoint> front,
                               measure_front(scene, compute, clock, [&](double f, std::string_view words) {
                                 report(progress, from + 0.5 * f, words);
                               }));
    fronts.push_back(std::move(front));
  }
  std::string source =
      "// Remade by `emberlock tradeoff recon --ship recon/pipeline/shipped_front.inc`; shipped_front.h says "
      "what "
      "it holds.\nconstexpr int kFinest = " +
      std::to_string(finest) +
      ";\n// voxels, iterations, effects, seconds, error\nconstexpr Row kRows[] = {\n";
  for (const WorkPoint& a : fronts[0]) {
    const auto b = std::find_if(fronts[1].begin(), fronts[1].end(),
                                [&](const WorkPoint& p) { return p.settings == a.settings; });
    if (b == fronts[1].end()) continue;
    source +=
        fmt::format("    {{{}, {}, \"{}\", {:.4g}, {:.4g}}},\n", a.settings.voxels, a.settings.iterations,
                    a.settings.effects, std::sqrt(a.seconds * b->seconds), std::sqrt(a.error * b->error));
  }
  return source + "};\n";
}

}  // namespace emberlock
