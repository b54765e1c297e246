// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/flat_field.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/square.h"

namespace emberlock::recon {
namespace {

/// A cell's light divided by the falloff, in its picture's own unit, and its standard deviation.
struct CellLight {
  double light, sigma;
};

std::optional<CellLight> cell_light(const PatchReading& cell, std::size_t channel,
                                    const ColourUnknowns& camera, double dark, const FlatReading& flat,
                                    double step) {
  if (use_of(cell, channel, dark) != ReadingUse::used) return std::nullopt;
  const double whole = std::exp(
      ResponseCurve::log_exposure(camera.response.data(), cell.mean[channel], cell.variance[channel]));
  const double slope =
      whole * ResponseCurve::log_slope(camera.response.data(), cell.mean[channel]) / cell.mean[channel];
  const double lens = falloff(camera.vignetting, radius_squared(flat.size, cell.x, cell.y));
  return CellLight{(whole - ResponseCurve::exposure(camera.response, dark)) / lens,
                   slope * mean_sigma(cell, channel, step) / lens};
}

/// Sums over pictures, weighted by their accuracy.
struct Mean {
  double sum = 0, weight = 0;
  [[nodiscard]] double value() const { return weight > 0 ? sum / weight : 1; }
};

void add_picture(const FlatReading& flat, std::size_t channel, const ColourUnknowns& camera, double dark,
                 double step, std::vector<Mean>& cells) {
  std::vector<std::optional<CellLight>> light;
  std::vector<double> known;
  for (const PatchReading& cell : flat.cells) {
    light.push_back(cell_light(cell, channel, camera, dark, flat, step));
    if (light.back()) known.push_back(light.back()->light);
  }
  if (known.empty()) return;
  const auto middle = known.begin() + static_cast<std::ptrdiff_t>(known.size() / 2);
  std::nth_element(known.begin(), middle, known.end());
  for (std::size_t i = 0; i < light.size(); ++i) {
    if (!light[i]) continue;
    const double weight = square(*middle / light[i]->sigma);
    cells[i].sum += weight * light[i]->light / *middle;
    cells[i].weight += weight;
  }
}

}  // namespace

FoundFlat find_flat(const std::vector<FlatReading>& flats, const ColourUnknowns& camera,
                    const DarkReading& dark, double step, double floor) {
  constexpr double kLeastLight = 0.1;  // less isn't dust but an object in front of the lens
  FoundFlat found;
  if (flats.empty()) return found;
  const std::size_t cells = flats.front().cells.size();
  found.flat = {flats.front().columns, flats.front().rows, std::vector<float>(3 * cells, 1.0F)};
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<Mean> means(cells);
    for (const FlatReading& flat : flats) add_picture(flat, c, camera, dark_sample(dark, c), step, means);
    double excess = 0;
    for (std::size_t i = 0; i < cells; ++i) {
      const double value = std::max(kLeastLight, means[i].value());
      if (means[i].weight > 0) excess += square(value - 1) - 1 / means[i].weight;
      found.worst = std::max(found.worst, std::abs(value - 1));
      found.flat.light[3 * i + c] = static_cast<float>(std::round(1e4 * value) / 1e4);
    }
    found.rms = std::max(found.rms, std::sqrt(std::max(0.0, excess / static_cast<double>(cells))));
  }
  if (found.rms < floor) found.flat = {};
  return found;
}

}  // namespace emberlock::recon
