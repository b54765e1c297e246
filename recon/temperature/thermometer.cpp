// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/thermometer.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace emberlock::recon {
namespace {

constexpr int kTrials = 48;           // evenly in 1 / T, before the best is refined
constexpr int kRefinements = 40;      // golden sections
constexpr double kLeastContrast = 1;  // chi-square by which the ends must be worse than the best

/// Where a function of one valley is least.
template <class Function>
double bottom_of(const Function& f, double low, double high) {
  constexpr double kGolden = 0.6180339887498949;
  for (int i = 0; i < kRefinements; ++i) {
    const double a = high - kGolden * (high - low);
    const double b = low + kGolden * (high - low);
    if (f(a) <= f(b)) {
      high = b;
    } else {
      low = a;
    }
  }
  return (low + high) / 2;
}

}  // namespace

bool absorption_counts(const Glow& glow, const EmitterTable& table) {
  return table.absolute() && glow.absorption_sigma > 0;
}

int data_of(const Glow& glow, const EmitterTable& table) {
  int data = absorption_counts(glow, table) ? 1 : 0;
  for (int c = 0; c < 3; ++c) data += glow.information(c, c) > 0 ? 1 : 0;
  return data;
}

Glow glow_of(const Eigen::Vector3d& level, const Eigen::Vector3d& sigma) {
  Glow glow;
  glow.level = level;
  for (int c = 0; c < 3; ++c)
    if (sigma[c] > 0 && std::isfinite(sigma[c])) glow.information(c, c) = 1 / (sigma[c] * sigma[c]);
  return glow;
}

double Thermometer::chi_square(const Glow& glow, double kelvin, double* absorption) const {
  const EmitterLevels levels = table_.at(Kelvin(kelvin));
  // A relative response's scale isn't known, so that its model has none: the absorption takes it.
  const double scale = table_.absolute() ? std::exp(levels.log_scale) : 1;
  const Eigen::Vector3d model = scale * Eigen::Vector3d::Map(levels.value.data());
  const Eigen::Vector3d weighted = glow.information * model;
  double data_square = glow.level.dot(glow.information * glow.level);
  double cross = weighted.dot(glow.level);
  double model_square = weighted.dot(model);
  if (absorption_counts(glow, table_)) {
    const double weight = 1 / (glow.absorption_sigma * glow.absorption_sigma);
    data_square += weight * glow.absorption * glow.absorption;
    cross += weight * glow.absorption;
    model_square += weight;
  }
  const double best = model_square > 0 ? std::max(0.0, cross / model_square) : 0;
  if (absorption != nullptr) *absorption = best;
  return data_square - best * (2 * cross - best * model_square);
}

Reading most_likely(Kelvin coldest, Kelvin hottest, int freedom,
                    const std::function<double(double)>& chi_square) {
  Reading out;
  out.freedom = freedom;
  const double cold = 1 / coldest.value();
  const double step = (1 / hottest.value() - cold) / (kTrials - 1);
  const auto chi = [&](double place) { return chi_square(1 / (cold + step * place)); };
  std::array<double, kTrials> trial = {};
  for (int i = 0; i < kTrials; ++i) trial[static_cast<std::size_t>(i)] = chi(i);
  const auto [best, worst] = std::minmax_element(trial.begin(), trial.end());
  if (!std::isfinite(*best) || !(*worst - *best > kLeastContrast)) return out;
  double place = 0;
  double least = INFINITY;
  for (std::size_t i = 0; i < kTrials; ++i) {
    const bool falls = i == 0 || trial[i] < trial[i - 1];
    const bool rises = i + 1 == kTrials || trial[i] <= trial[i + 1];
    if (!falls || !rises) continue;  // else a valley, and narrow ones have their bottoms between the trials
    const double bottom = bottom_of(chi, std::max(0.0, static_cast<double>(i) - 1),
                                    std::min(kTrials - 1.0, static_cast<double>(i) + 1));
    const double depth = chi(bottom);
    if (depth < least) place = bottom;
    least = std::min(least, depth);
  }
  out.kelvin = 1 / (cold + step * place);
  out.chi_square = chi_square(out.kelvin);
  constexpr double kEnd = 1e-3;
  out.told = place < kEnd                 ? Reading::Told::colder
             : place > kTrials - 1 - kEnd ? Reading::Told::hotter
                                          : Reading::Told::yes;
  // The likelihood's curvature where chi-square has risen by about one: differences that are too small would
  // measure rounding.
  const double reach = std::clamp(1e-3 * out.kelvin, 0.1, 20.0);
  const double curvature =
      (chi_square(out.kelvin + reach) + chi_square(out.kelvin - reach) - 2 * out.chi_square) /
      (reach * reach);
  if (!(curvature > 0)) {
    out.told = Reading::Told::no;
    return out;
  }
  const double misfit = out.freedom > 0 ? std::max(1.0, out.chi_square / out.freedom) : 1;
  out.sigma = std::sqrt(2 / curvature * misfit);
  return out;
}

Reading Thermometer::read(const Glow& glow) const {
  const int data = data_of(glow, table_);
  if (data < 2) return {};
  Reading out = most_likely(table_.coldest(), table_.hottest(), data - 2,
                            [&](double kelvin) { return chi_square(glow, kelvin); });
  if (out.kelvin > 0) out.chi_square = chi_square(glow, out.kelvin, &out.absorption);
  return out;
}

}  // namespace emberlock::recon
