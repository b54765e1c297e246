// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/error_summary.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace emberlock::recon {
namespace {

double square(float v) { return static_cast<double>(v) * static_cast<double>(v); }

}  // namespace

float light_at(const Volume& volume, std::size_t point) {
  const float* e = volume.emission.data() + 3 * point;
  return std::max({e[0], e[1], e[2]});
}

ErrorSummary error_summary(const Volume& volume, const VolumeErrors& errors,
                           const std::optional<NoiseErrors>& noise) {
  ErrorSummary out;
  out.solves = errors.solves;
  out.models = errors.models;
  out.views_time = errors.time;
  if (noise) out.noise = {noise->noise, 0, 0, noise->probes, noise->time};
  const auto least = static_cast<float>(kLightThatCounts) *
                     *std::max_element(volume.emission.begin(), volume.emission.end());
  double points = 0;
  for (std::size_t p = 0; p < volume.grid.size(); ++p) {
    if (!(light_at(volume, p) > least)) continue;
    ++points;
    out.emission += errors.covariance(p).trace() / 3;
    if (!errors.extinction.empty()) out.extinction += square(errors.extinction[p]);
    for (std::size_t i = 3 * p; i < 3 * p + 3; ++i) {
      out.light += square(volume.emission[i]) / 3;
      if (noise) out.noise->emission += square(noise->emission[i]) / 3;
    }
    if (noise && !noise->extinction.empty()) out.noise->extinction += square(noise->extinction[p]);
  }
  if (!(points > 0)) return out;
  for (double* sum : {&out.light, &out.emission, &out.extinction}) *sum = std::sqrt(*sum / points);
  if (noise)
    for (double* sum : {&out.noise->emission, &out.noise->extinction}) *sum = std::sqrt(*sum / points);
  return out;
}

}  // namespace emberlock::recon
