// SPDX-License-Identifier: Apache-2.0
#include "report/measured_pictures.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "recon/export/error_words.h"
#include "recon/export/preview.h"
#include "recon/export/temperature_words.h"
#include "report/html.h"
#include "report/value_slices.h"

namespace emberlock::report {
namespace {

std::string paragraph(std::string_view clause) { return "<p>" + html_escape(sentence(clause)) + "</p>"; }

}  // namespace

std::string temperature_html(const recon::Outcome& outcome, const ShownAxes& axes) {
  if (!outcome.temperature) return {};
  const recon::TemperatureField& field = *outcome.temperature;
  const recon::TemperatureSummary& summary = field.summary;
  std::string html = "<h2>Temperature</h2>";
  for (const std::string& words : recon::temperature_words(summary)) html += paragraph(words);
  if (summary.counts.told == 0) return html;
  const recon::BarEnds kelvin = recon::kelvin_bar(summary.low, summary.high);
  const recon::BarEnds sigma = recon::kelvin_sigma_bar(summary.sigma);
  const recon::Grid& grid = outcome.reconstruction.volume.grid;
  html += value_slices_html(grid, field.kelvin, axes, {kelvin.low, kelvin.high, "K"}, "temperature");
  html += value_slices_html(grid, field.sigma, axes, {sigma.low, sigma.high, "K"}, "its error (one sigma)");
  return html + paragraph("grey: not told. The grids temperature and temperature_sigma are in volume.vdb");
}

std::string errors_html(const recon::Outcome& outcome, const ShownAxes& axes) {
  if (!outcome.errors) return {};
  const recon::VolumeErrors& errors = *outcome.errors;
  const recon::Volume& volume = outcome.reconstruction.volume;
  const double brightest =
      static_cast<double>(*std::max_element(volume.emission.begin(), volume.emission.end()));
  std::vector<float> emission(volume.grid.size());
  std::vector<float> extinction(errors.extinction.empty() ? 0 : emission.size());
  for (std::size_t p = 0; p < emission.size(); ++p) {
    if (!(static_cast<double>(recon::light_at(volume, p)) > recon::kLightThatCounts * brightest)) continue;
    emission[p] = static_cast<float>(errors.sigma(p).mean() / 100);
    if (!extinction.empty()) extinction[p] = errors.extinction[p];
  }
  std::string html = "<h2>Errors</h2>";
  html += paragraph(
      "how far each voxel may be off, by solves without some of the views: that holds the pictures' noise, "
      "and what a view more or less would change");
  if (outcome.report.errors)
    for (const std::string& words : recon::error_words(*outcome.report.errors)) html += paragraph(words);
  const auto add = [&](const std::vector<float>& values, const char* unit, const char* what) {
    html += value_slices_html(volume.grid, values, axes, {0, recon::end_of_bar(values), unit}, what);
  };
  add(emission, "grey levels a centimetre", "error of the light, mean of R, G and B,");
  if (outcome.noise) {
    std::vector<float> noise(emission.size());
    for (std::size_t p = 0; p < noise.size(); ++p)
      if (emission[p] > 0)
        noise[p] = (outcome.noise->emission[3 * p] + outcome.noise->emission[3 * p + 1] +
                    outcome.noise->emission[3 * p + 2]) /
                   300;
    add(noise, "grey levels a centimetre", "what of it noise makes,");
  }
  if (!extinction.empty()) add(extinction, "1/m", "error of the extinction");
  const bool field = !extinction.empty();
  std::string grids = field ? "emission_sigma and density_sigma" : "emission_sigma";
  if (outcome.noise) grids += field ? ", emission_noise and density_noise" : " and emission_noise";
  return html + paragraph("grey: hardly any light. In volume.vdb: " + grids);
}

}  // namespace emberlock::report
