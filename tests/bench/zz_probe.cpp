// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include "evaluate/paper/known_gas.h"
#include "evaluate/paper/run.h"
#include "evaluate/paper/run_errors.h"
#include "recon/adjust/choose_effects.h"
#include "recon/adjust/solver.h"
using namespace emberlock;
int main(int argc, char** argv) {
  const auto gas = *evaluate::read_gas(evaluate::Subject::flame, argv[1], {});
  const int voxels = std::atoi(argv[2]);
  float top = 0; double sum = 0; std::size_t n = 0;
  for (float e : gas.light.extinction) { top = std::max(top, e); if (e > 0.5F) { sum += e; ++n; } }
  std::printf("extinction: most %g, mean where > .5 %g, share %g\n", top, sum / static_cast<double>(n), static_cast<double>(n) / static_cast<double>(gas.light.extinction.size()));
  evaluate::Case of = evaluate::nine_views_protocol(evaluate::Extent::full).cases[0];
  if (argc > 3) of.image = {std::atoi(argv[3]), std::atoi(argv[3]) * 3 / 4};
  const recon::Scene scene = evaluate::film(gas, of, 1, {});
  const recon::Scene inputs = evaluate::input_views(scene);
  const recon::Grid grid = recon::grid_over(scene.box, voxels);
  const auto choice = *recon::choose_effects(inputs, grid, {}, {});
  for (const auto& r : choice.reports) std::printf("  %s %s: %s\n", r.name.c_str(), r.on ? "ON" : "off", r.reason.c_str());
  auto run = [&](const char* name, const recon::Effects& effects, std::optional<double> smooth) {
    recon::SolveOptions o; o.smoothness = smooth;
    const auto t0 = std::chrono::steady_clock::now();
    const auto r = recon::solve(inputs, grid, effects, o);
    const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - t0).count();
    if (!r.ok()) { std::printf("%s: %s\n", name, r.error().message().c_str()); return; }
    evaluate::MethodResult m{r->volume, r->hull, r->effects, r->iterations};
    const auto shown = evaluate::show(m, scene, {});
    const auto e = evaluate::errors_of(m, shown, scene, gas);
    float most = 0; for (float x : r->volume.extinction) most = std::max(most, x);
    std::printf("%-24s smooth %.3f its %d: input %.2f test %.2f volume %.3f  ext max %.2f hull %zu  %.2f s\n", name, r->smoothness, r->iterations, e.input[0], e.test[0], e.volume[0], most, r->hull.count, s);
  };
  run("auto", choice.effects, {});
  run("none", recon::Effects{}, {});
  for (const double s : {0.0, 0.003, 0.01, 0.03, 0.1, 0.3}) run("none", recon::Effects{}, s);
}
