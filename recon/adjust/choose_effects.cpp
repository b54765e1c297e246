#include "recon/adjust/choose_effects.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "recon/adjust/descent.h"

namespace emberlock {
namespace {

constexpr int kCoarse = 64;           // voxels along the longest side, at most
constexpr int kPasses = 24;           // of a cold solve
constexpr std::size_t kRays = 20000;  // about as many as a cold solve is given
constexpr int kRefinements = 3;

/// Cold solves of one coarse problem under different extinctions, each by as many full gradients: candidates
/// must differ in the extinction alone, not in how far they got.
class Probe {
 public:
  Probe(const SolverSetup& setup, const Hull& hull)
      : setup_(setup), hull_(hull), level_(pose_level(setup, hull, stride(setup, hull), 1)) {}

  /// Held-out pixels' RMS after a cold solve, and the solution.
  double solve(PerMeter extinction, std::vector<Rgba>& x) const {
    Descent descent(level_, absorbing_optics(sigma(extinction)), Precision::float32, setup_.device,
                    setup_.pool);
    for (int p = 0; p < kPasses; ++p) descent.pass();
    x = descent.engine().get();
    return descent.validation_error();
  }

  /// RMS difference between the pictures of x with and without extinction, after the best gain on the latter.
  [[nodiscard]] double change(PerMeter extinction, const std::vector<Rgba>& x) const {
    const std::vector<Rgba> with = pictures(extinction, x);
    const std::vector<Rgba> without = pictures(PerMeter(0), x);
    double ww = 0;
    double wo = 0;
    double oo = 0;
    for (std::size_t r = 0; r < with.size(); ++r) {
      for (std::size_t c = 0; c < 3; ++c) {
        const auto a = static_cast<double>(with[r].c[c]);
        const auto b = static_cast<double>(without[r].c[c]);
        ww += a * a;
        wo += a * b;
        oo += b * b;
      }
    }
    if (oo <= 0) return 0;
    return std::sqrt(std::max(0.0, ww - wo * wo / oo) / (3 * static_cast<double>(with.size())));
  }

  /// Mean length of a ray inside the hull.
  [[nodiscard]] Meters mean_chord() const {
    double sum = 0;
    for (const Run& run : level_.problem.list.runs) sum += static_cast<double>(run.step) * run.count;
    const double rays = std::max(1.0, static_cast<double>(level_.problem.list.rays.size()));
    return Meters(sum / rays * static_cast<double>(hull_.grid.edge));
  }

 private:
  [[nodiscard]] float sigma(PerMeter extinction) const {
    return static_cast<float>(extinction.value() * static_cast<double>(hull_.grid.edge));
  }
  static int stride(const SolverSetup& setup, const Hull&) {
    double pixels = 0;
    for (const PixelBox& b : setup.boxes) pixels += static_cast<double>(b.x1 - b.x0) * (b.y1 - b.y0);
    return std::max(1, static_cast<int>(std::lround(std::sqrt(pixels / static_cast<double>(kRays)))));
  }
  [[nodiscard]] std::vector<Rgba> pictures(PerMeter extinction, const std::vector<Rgba>& x) const {
    const auto engine = make_engine(level_.problem, absorbing_optics(sigma(extinction)), Precision::float32,
                                    setup_.device, setup_.pool);
    engine->set(x);
    for (int s = 0; s < level_.problem.list.subsets(); ++s) engine->project(s);
    return engine->residuals();
  }

  const SolverSetup& setup_;
  const Hull& hull_;
  Level level_;
};

struct Candidate {
  PerMeter extinction{0};
  double error = 0;
  std::vector<Rgba> x;
};

/// The lowest of the parabola through three points of (extinction, squared error), kept inside their range.
PerMeter vertex(const Candidate& a, const Candidate& b, const Candidate& c) {
  const double xa = a.extinction.value();
  const double xb = b.extinction.value();
  const double xc = c.extinction.value();
  const double ab = (b.error * b.error - a.error * a.error) / (xb - xa);
  const double bc = (c.error * c.error - b.error * b.error) / (xc - xb);
  const double curvature = (bc - ab) / (xc - xa);
  if (!(curvature > 0)) return b.extinction;
  return PerMeter(std::clamp(0.5 * (xa + xb) - 0.5 * ab / curvature, xa, xc));
}

/// A global search: descent from a wrong scale stays wrong, so candidates are cold solves over the whole
/// range, then a parabola around the best.
Candidate search(const Probe& probe) {
  std::vector<Candidate> tried;
  const auto try_one = [&](PerMeter extinction) {
    Candidate c{extinction, 0, {}};
    c.error = probe.solve(extinction, c.x);
    const auto at =
        std::lower_bound(tried.begin(), tried.end(), c,
                         [](const Candidate& a, const Candidate& b) { return a.extinction < b.extinction; });
    tried.insert(at, std::move(c));
  };
  for (const double depth : {0.0, 0.2, 0.5, 1.0, 3.0}) try_one(PerMeter(depth / probe.mean_chord().value()));
  const auto best = [&] {
    return std::min_element(tried.begin(), tried.end(),
                            [](const Candidate& a, const Candidate& b) { return a.error < b.error; });
  };
  for (int i = 0; i < kRefinements; ++i) {
    const auto b = best();
    if (b == tried.begin() || b + 1 == tried.end()) break;
    const PerMeter next = vertex(*(b - 1), *b, *(b + 1));
    const bool known = std::any_of(tried.begin(), tried.end(), [&](const Candidate& c) {
      return abs(c.extinction - next).value() <= 0.02 * next.value();
    });
    if (known) break;
    try_one(next);
  }
  return *best();
}

std::string text(const char* format, double a, double b) {
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, format, a, b);
  return buffer;
}

}  // namespace

Result<EffectChoice> choose_effects(const Scene& scene, const Grid& grid, const EffectRequest& request,
                                    const SolveOptions& options, const Elapsed& elapsed) {
  EMBERLOCK_RETURN_IF_ERROR(check_scene(scene));
  EMBERLOCK_ASSIGN_OR_RETURN(const Device device, resolve(options.compute.device));
  const Seconds start = elapsed ? elapsed() : Seconds(0);
  const std::vector<FlameMask> masks = flame_masks(scene, options.flame_threshold);
  EMBERLOCK_ASSIGN_OR_RETURN(Hull hull, carve(scene, masks, grid, options.compute));
  while (std::max({hull.grid.nx, hull.grid.ny, hull.grid.nz}) - 1 > kCoarse) hull = coarsen(hull);
  Pool pool(options.compute.threads);
  SolverSetup setup{{}, {}, hull, {}, options, device, pool};
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].role != ViewRole::input) continue;
    setup.views.push_back(&scene.views[v]);
    const ImageSize size = scene.views[v].image.size;
    setup.boxes.push_back(masks[v].box.empty() ? PixelBox{0, 0, size.width, size.height} : masks[v].box);
  }
  const Probe probe(setup, hull);

  Candidate chosen;
  EffectReport report{"extinction", false, 0, {}, {}};
  if (request.fixed) {
    chosen.extinction = request.fixed->extinction.value;
    if (chosen.extinction.value() > 0) chosen.error = probe.solve(chosen.extinction, chosen.x);
    report.on = chosen.extinction.value() > 0;
    report.reason = "set by hand";
  } else {
    chosen = search(probe);
  }
  if (chosen.extinction.value() > 0) report.predicted_change = probe.change(chosen.extinction, chosen.x);
  if (!request.fixed) {
    report.on = report.predicted_change >= request.tolerance;
    report.reason = report.on
                        ? text("%.3g / m fits the pictures best, to %.3g grey levels on a coarse grid",
                               chosen.extinction.value(), chosen.error)
                        : text("the best fit, %.3g / m, changes the pictures by less than %.2g grey levels",
                               chosen.extinction.value(), request.tolerance);
  }
  report.seconds = (elapsed ? elapsed() : Seconds(0)) - start;
  EffectChoice choice;
  if (report.on) choice.effects.extinction = constant_extinction(chosen.extinction);
  choice.reports.push_back(std::move(report));
  return choice;
}

}  // namespace emberlock
