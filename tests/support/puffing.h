// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

#include "recon/synthetic/flame_simulation.h"

namespace emberlock {

/// How a pool fire is filmed to count its puffs.
struct PuffingCase {
  double diameter = 0.3;   ///< m, of the burner
  int cells = 24;          ///< across, three diameters wide
  int height = 48;         ///< cells
  double settle = 2;       ///< s, before counting
  double duration = 8;     ///< s
  double interval = 0.02;  ///< s
  recon::ComputeOptions compute;
};

struct Puffing {
  double frequency = 0;       ///< Hz, of the strongest line of the heat release's spectrum
  double rise_frequency = 0;  ///< the same of `rise`, as fires' probes measure it
  double expected = 0;        ///< 1.5 / sqrt(D)
  std::vector<double> heat;   ///< W, one an interval
  std::vector<double> rise;   ///< m/s upwards on the axis, half a diameter above the burner
};

/// The strongest frequency between `low` and `high`, Hz, of samples `interval` s apart: the peak of their
/// periodogram without mean, with a Hann window, at frequencies 0.01 Hz apart.
inline double strongest_frequency(const std::vector<double>& samples, double interval, double low,
                                  double high) {
  double mean = 0;
  for (const double s : samples) mean += s / static_cast<double>(samples.size());
  double best = 0;
  double most = -1;
  for (double f = low; f <= high; f += 0.01) {
    std::complex<double> sum;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double part = static_cast<double>(i) / static_cast<double>(samples.size() - 1);
      const double window = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * part);
      sum += window * (samples[i] - mean) *
             std::polar(1.0, -2 * std::numbers::pi * f * interval * static_cast<double>(i));
    }
    if (std::norm(sum) > most) {
      most = std::norm(sum);
      best = f;
    }
  }
  return best;
}

/// The mean of the four cells around the axis at a height.
inline double rise_on_axis(const recon::GasState& gas, double height) {
  const recon::Grid& g = gas.grid;
  const int k = static_cast<int>(height / static_cast<double>(g.edge));
  double sum = 0;
  for (const int j : {g.ny / 2 - 1, g.ny / 2})
    for (const int i : {g.nx / 2 - 1, g.nx / 2})
      sum += static_cast<double>(gas.velocity[3 * g.index(i, j, k) + 2]);
  return sum / 4;
}

/// Frequency 0 where the simulation fails.
inline Puffing count_puffs(const PuffingCase& c) {
  Puffing result;
  result.expected = 1.5 / std::sqrt(c.diameter);
  recon::FlameSimulationOptions o = recon::flame_preset(recon::FlamePreset::pool_fire, c.cells);
  o.nz = c.height;
  o.edge = Meters(3 * c.diameter / c.cells);
  o.burners.front().radius = Meters(c.diameter / 2);
  o.compute = c.compute;
  auto fire = recon::FlameSimulation::make(o);
  if (!fire.ok()) return result;
  while (fire->time() < Seconds(c.settle))
    if (!fire->step(Seconds(c.interval)).ok()) return result;
  while (static_cast<double>(result.heat.size()) * c.interval < c.duration) {
    const auto stats = fire->step(Seconds(c.interval));
    if (!stats.ok()) return result;
    result.heat.push_back(stats->heat_release);
    result.rise.push_back(rise_on_axis(fire->state(), c.diameter / 2));
  }
  const double low = 0.3 * result.expected;
  const double high = 4 * result.expected;
  result.frequency = strongest_frequency(result.heat, c.interval, low, high);
  result.rise_frequency = strongest_frequency(result.rise, c.interval, low, high);
  return result;
}

}  // namespace emberlock
