// SPDX-License-Identifier: Apache-2.0
#include "recon/render/ordinates.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace emberlock::recon {
namespace {

/// Node `i` of the n Gauss-Legendre nodes on (-1, 1), by Newton's method, and its weight.
std::array<double, 2> gauss_legendre(int n, int i) {
  double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5));
  double slope = 1;
  for (int iteration = 0; iteration < 50; ++iteration) {
    double previous = 1;
    double p = x;
    for (int l = 2; l <= n; ++l) {
      const double next = ((2 * l - 1) * x * p - (l - 1) * previous) / l;
      previous = p;
      p = next;
    }
    slope = n * (x * p - previous) / (x * x - 1);
    const double change = p / slope;
    x -= change;
    if (std::abs(change) < 1e-15) break;
  }
  return {x, 2 / ((1 - x * x) * slope * slope)};
}

/// The asymmetry at which the moment of the ordinates' degree has fallen to 2 %: sharper peaks lie between
/// the ordinates.
double resolved_asymmetry(int levels) { return std::pow(0.02, 1.0 / (2 * levels)); }

}  // namespace

std::vector<Ordinate> product_ordinates(int octant_levels) {
  const int levels = 2 * octant_levels;
  std::vector<Ordinate> out;
  for (int i = 0; i < levels; ++i) {
    const auto [cosine, weight] = gauss_legendre(levels, i);
    const double sine = std::sqrt(1 - cosine * cosine);
    for (int j = 0; j < 2 * levels; ++j) {
      const double azimuth = std::numbers::pi * (j + 0.5) / levels;
      Ordinate o;
      o.travel[0] = static_cast<float>(sine * std::cos(azimuth));
      o.travel[1] = static_cast<float>(sine * std::sin(azimuth));
      o.travel[2] = static_cast<float>(cosine);
      o.weight = static_cast<float>(weight * std::numbers::pi / levels);
      out.push_back(o);
    }
  }
  return out;
}

SplitPhase split_phase(double asymmetry, int octant_levels) {
  const double sharp = std::abs(asymmetry);
  const double blunt = std::min(sharp, resolved_asymmetry(2 * octant_levels));
  return {{static_cast<float>(std::copysign(blunt, asymmetry))}, (sharp - blunt) / (1 - blunt)};
}

std::vector<float> phase_matrix(const SplitPhase& phase, const std::vector<Ordinate>& ordinates) {
  const std::size_t n = ordinates.size();
  if (phase.isotropic()) {
    std::vector<float> row(n);
    for (std::size_t m = 0; m < n; ++m)
      row[m] = ordinates[m].weight / static_cast<float>(4 * std::numbers::pi);
    return row;
  }
  const HenyeyGreenstein<double> blunt{static_cast<double>(phase.blunt.g)};
  const auto cosine = [&](std::size_t a, std::size_t b) {
    double sum = 0;
    for (int c = 0; c < 3; ++c)
      sum += static_cast<double>(ordinates[a].travel[c]) * static_cast<double>(ordinates[b].travel[c]);
    return sum;
  };
  std::vector<double> p(n * n);
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b < n; ++b)
      p[a * n + b] = blunt(cosine(a, b)) * static_cast<double>(ordinates[b].weight);
  std::vector<double> scale(n, 1);
  for (int iteration = 0; iteration < 50; ++iteration) {
    for (std::size_t a = 0; a < n; ++a) {
      double sum = 0;
      for (std::size_t b = 0; b < n; ++b) sum += p[a * n + b] * scale[b];
      scale[a] = std::sqrt(scale[a] / sum);
    }
  }
  std::vector<float> out(n * n);
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = 0; b < n; ++b) {
      const bool peaks = phase.blunt.g < 0 ? cosine(a, b) < -0.99999 : a == b;
      out[a * n + b] = static_cast<float>((1 - phase.peak) * scale[a] * p[a * n + b] * scale[b] +
                                          (peaks ? phase.peak : 0));
    }
  }
  return out;
}

}  // namespace emberlock::recon
