// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/find_extinction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>

#include "recon/adjust/cold_solve.h"

namespace emberlock::recon {
namespace {

constexpr int kCoarse = 64;           // voxels along the longest side, at most
constexpr std::size_t kRays = 30000;  // about as many pixels of the flames' boxes are looked at

struct Candidate {
  Extinction extinction;
  double error = 0;
  std::shared_ptr<const Engine> engine;
};

Extinction guess(PerMeter even, PerMeter soot) {
  if (even.value() + soot.value() <= 0) return {};
  return {Extinction::Model::field, even, soot};
}

/// Cold solves of one coarse problem, all by as many steps: candidates must differ in the extinction alone.
class Probe {
 public:
  explicit Probe(const SolverSetup& setup)
      : setup_(setup),
        hull_(coarsen_to(setup.hull, kCoarse)),
        level_(make_level(setup, hull_, stride_for_rays(setup, kRays), 4)) {}

  [[nodiscard]] Candidate solve(const Extinction& extinction) const {
    ColdSolve solved = cold_solve(setup_, level_, extinction);
    return {extinction, solved.error, std::move(solved.engine)};
  }

  /// Mean length of a ray inside the hull.
  [[nodiscard]] Meters mean_chord() const {
    const double rays = std::max(1.0, static_cast<double>(level_.problem.rays()));
    return Meters(total_length(level_.problem.list, setup_.pool) / rays *
                  static_cast<double>(hull_.grid.edge));
  }

  [[nodiscard]] FoundExtinction result(const Candidate& c) const {
    Effects effects;
    effects.extinction = c.extinction;
    const std::vector<Rgba> x = c.engine ? c.engine->get() : std::vector<Rgba>(level_.problem.grid().size());
    return {c.extinction, c.error, to_volume(x, level_.problem, hull_, effects), hull_};
  }

 private:
  const SolverSetup& setup_;
  Hull hull_;
  Level level_;
};

/// The lowest of the parabola through three points (place, squared error), kept inside their range.
double vertex(const std::array<double, 3>& x, const std::array<double, 3>& error) {
  const double ab = (error[1] * error[1] - error[0] * error[0]) / (x[1] - x[0]);
  const double bc = (error[2] * error[2] - error[1] * error[1]) / (x[2] - x[1]);
  const double curvature = (bc - ab) / (x[2] - x[0]);
  if (!(curvature > 0) || !std::isfinite(curvature)) return x[1];  // solves that diverged are infinite
  return std::clamp(0.5 * (x[0] + x[1]) - 0.5 * ab / curvature, x[0], x[2]);
}

/// Tries places along a line, then the vertex of the parabola around the best.
template <class Try, class Late>
Candidate search_line(const Pool& pool, const std::vector<double>& places, const Try& attempt,
                      const Late& late) {
  std::vector<std::optional<Candidate>> attempts(places.size());
  std::mutex asking;
  at_once(pool, static_cast<int>(places.size()), [&](int n) {
    const auto at = static_cast<std::size_t>(n);
    const auto too_late = [&] {
      const std::lock_guard lock(asking);  // the caller's clock need not be for several threads
      return late();
    };
    if (at == 0 || !too_late()) attempts[at] = attempt(places[at]);
  });
  std::vector<Candidate> tried;  // up to the first that came too late
  for (std::size_t n = 0; n < attempts.size() && attempts[n]; ++n) tried.push_back(*std::move(attempts[n]));
  const auto better = [](const Candidate& a, const Candidate& b) { return a.error < b.error; };
  const auto best = std::min_element(tried.begin(), tried.end(), better);
  const auto at = static_cast<std::size_t>(best - tried.begin());
  if (at == 0 || at + 1 == tried.size() || late()) return *best;
  const double next = vertex({places[at - 1], places[at], places[at + 1]},
                             {tried[at - 1].error, tried[at].error, tried[at + 1].error});
  if (std::abs(next - places[at]) <= 0.05 * (places[at + 1] - places[at - 1])) return *best;
  Candidate refined = attempt(next);
  return better(refined, *best) ? refined : *best;
}

}  // namespace

FoundExtinction find_extinction(const SolverSetup& setup, const Elapsed& elapsed) {
  const auto late = [&] { return is_spent(1.0 / 3, setup.options, elapsed); };
  const Probe probe(setup);
  const double chord = probe.mean_chord().value();
  const Candidate even = search_line(
      setup.pool, {0.0, 0.3, 0.7, 1.2, 3.0},
      [&](double depth) { return probe.solve(guess(PerMeter(depth / chord), PerMeter(0))); }, late);
  const double total = even.extinction.value.value();
  if (total <= 0 || late()) return probe.result(even);
  // The same mean, from all even to all like soot.
  const Candidate mixed = search_line(
      setup.pool, {0.0, 0.5, 1.0},
      [&](double share) {
        return share == 0 ? even : probe.solve(guess(PerMeter((1 - share) * total), PerMeter(share * total)));
      },
      late);
  return probe.result(mixed);
}

FoundExtinction try_extinction(const SolverSetup& setup, const Extinction& extinction) {
  const Probe probe(setup);
  Extinction field = extinction;
  if (field.model == Extinction::Model::constant) field.model = Extinction::Model::field;
  return probe.result(probe.solve(field));
}

}  // namespace emberlock::recon
