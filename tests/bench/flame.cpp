// SPDX-License-Identifier: Apache-2.0
// The flame simulator's figures (recon/synthetic/flame_simulation.h), as tables:
//   bench_flame step [CELLS] [THREADS]    a substep's wall and core time for each preset, CELLS^3 (default
//                                         128), as it begins to burn; divergence and iterations beside it
//   bench_flame puffs [CELLS] [D ...]     how often a pool fire of diameter D (1 and 0.3 m) puffs, by the
//                                         spectra of its heat release and of the rise on its axis (a probe
//                                         D / 2 above the burner), CELLS across (24), beside 1.5/sqrt(D)
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <limits>
#include <vector>

#include "recon/synthetic/flame_simulation.h"
#include "tests/support/puffing.h"

namespace {

using namespace emberlock;

constexpr recon::FlamePreset kPresets[] = {recon::FlamePreset::candle, recon::FlamePreset::pool_fire,
                                           recon::FlamePreset::torch, recon::FlamePreset::two_plumes,
                                           recon::FlamePreset::smoke};

/// The least of a few steps of a substep each.
int time_steps(int cells, int threads) {
  std::printf("%-11s %5s %9s %9s %6s %10s %6s %9s\n", "preset", "cells", "wall ms", "core ms", "iter",
              "divergence", "CFL", "hottest K");
  for (const recon::FlamePreset preset : kPresets) {
    recon::FlameSimulationOptions o = recon::flame_preset(preset, cells);
    o.nz = cells;
    o.compute = {recon::Device::automatic, threads};
    auto flame = recon::FlameSimulation::make(o);
    double dt = 0.2 * std::sqrt(o.edge.value() / 9.81);  // less than what any preset's gas passes a cell in
    if (o.diffusivity > 0) dt = std::min(dt, o.edge.value() * o.edge.value() / (12.1 * o.diffusivity));
    double wall = std::numeric_limits<double>::infinity();
    double core = wall;
    recon::FluidStats last;
    for (int i = 0; i < 5; ++i) {
      const auto start = std::chrono::steady_clock::now();
      const std::clock_t core_start = std::clock();
      const auto stats = flame->step(Seconds(dt));
      if (!stats.ok()) {
        std::fprintf(stderr, "%s\n", stats.error().message().c_str());
        return 1;
      }
      last = *stats;
      const double parts = std::max(1, last.substeps);
      wall = std::min(
          wall, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / parts);
      core = std::min(core, static_cast<double>(std::clock() - core_start) / CLOCKS_PER_SEC / parts);
    }
    std::printf("%-11s %5d %9.1f %9.1f %6.1f %10.1e %6.2f %9.0f\n", std::string(name(preset)).c_str(), cells,
                1e3 * wall, 1e3 * core, static_cast<double>(last.iterations) / std::max(1, last.substeps),
                last.relative_divergence, last.cfl, last.hottest.value());
    std::fflush(stdout);
  }
  return 0;
}

int count(int cells, const std::vector<double>& diameters) {
  std::printf("%6s %6s %10s %7s %10s %7s %12s %9s\n", "D m", "cells", "heat Hz", "ratio", "rise Hz", "ratio",
              "1.5/sqrt(D)", "wall s");
  for (const double diameter : diameters) {
    PuffingCase c;
    c.diameter = diameter;
    c.cells = cells;
    c.height = (cells * 4 / 3 + 7) / 8 * 8;
    c.settle = 4 * std::sqrt(diameter);
    c.duration = 12 * std::sqrt(diameter);
    c.interval = 0.03 * std::sqrt(diameter);
    const auto start = std::chrono::steady_clock::now();
    const Puffing puffing = count_puffs(c);
    std::printf("%6.2f %6d %10.3f %7.3f %10.3f %7.3f %12.3f %9.1f\n", diameter, cells, puffing.frequency,
                puffing.frequency / puffing.expected, puffing.rise_frequency,
                puffing.rise_frequency / puffing.expected, puffing.expected,
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const bool puffs = argc > 1 && std::strcmp(argv[1], "puffs") == 0;
  if (!puffs) return time_steps(argc > 2 ? std::atoi(argv[2]) : 128, argc > 3 ? std::atoi(argv[3]) : 0);
  std::vector<double> diameters;
  for (int i = 3; i < argc; ++i) diameters.push_back(std::atof(argv[i]));
  if (diameters.empty()) diameters = {1.0, 0.3};
  return count(argc > 2 ? std::atoi(argv[2]) : 24, diameters);
}
