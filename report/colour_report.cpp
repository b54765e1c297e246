// SPDX-License-Identifier: Apache-2.0
#include "report/colour_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "report/html.h"

namespace emberlock::report {
namespace {

std::string flat_words(const recon::CalibratedColour& c) {
  if (c.flat_worst == 0) return "no flat picture";
  return fmt::format("{:.2f} % RMS, {:.1f} % at most{}", 100 * c.flat_rms, 100 * c.flat_worst,
                     c.colour.flat.light.empty() ? ": left out, as noise" : "");
}

std::vector<std::vector<std::string>> camera_rows(const recon::ColourCalibration& calibration) {
  std::vector<std::vector<std::string>> rows;
  for (const recon::CalibratedColour& c : calibration.cameras) {
    const auto gain = [&](std::size_t channel) {
      return c.shares_patches
                 ? fmt::format("{:.4f} ± {:.2f} %", c.colour.gain[channel], 100 * c.gain_sigma[channel])
                 : std::string("not known");
    };
    rows.push_back(
        {c.camera, gain(0), gain(1), gain(2), fmt::format("{:.3f}", c.gamma),
         c.vignetting_known ? fmt::format("{:.3f} ± {:.3f}", c.corner, c.corner_sigma) : "not known",
         flat_words(c), fmt::format("{:.5f}", c.colour.dark[1]), std::to_string(c.colour.hot_pixels.size()),
         fmt::format("{:.2f} %", 100 * c.rms),
         fmt::format("{} / {} / {} / {}", c.uses[0], c.uses[1], c.uses[2], c.uses[3])});
  }
  return rows;
}

/// One curve per camera, with values at even intervals over 0..1; cameras without a curve are omitted.
std::string camera_curves(const recon::ColourCalibration& calibration, const PlotOptions& options,
                          const std::function<double(const recon::CalibratedColour&, double)>& curve) {
  constexpr int kPoints = 51;
  std::vector<Series> series;
  for (const recon::CalibratedColour& c : calibration.cameras) {
    Series s;
    s.name = c.camera;
    for (int i = 0; i < kPoints; ++i) {
      s.x.push_back(static_cast<double>(i) / (kPoints - 1));
      s.y.push_back(curve(c, s.x.back()));
    }
    series.push_back(std::move(s));
  }
  return svg_plot(series, options);
}

std::string response_plot(const recon::ColourCalibration& calibration) {
  PlotOptions options;
  options.title = "Response: what exposure a sample tells";
  options.x_label = "sample / white";
  options.y_label = "exposure / that of white";
  return camera_curves(calibration, options, [](const recon::CalibratedColour& c, double sample) {
    return recon::exposure_of(c.colour, sample);
  });
}

/// Relative deviation of the readings' exposures from the common fit of all cameras.
std::string residual_plot(const recon::ColourReadings& readings,
                          const recon::ColourCalibration& calibration) {
  std::vector<Series> series(readings.cameras.size());
  for (std::size_t i = 0; i < series.size(); ++i) {
    series[i].name = readings.cameras[i].id;
    series[i].mark = Mark::points;
  }
  for (const recon::ColourResidual& r : calibration.residuals) {
    if (r.use != recon::ReadingUse::used || r.exposure <= 0) continue;
    Series& s = series[readings.patches[r.reading].camera];
    s.x.push_back(r.exposure);
    s.y.push_back(100 * r.relative);
  }
  PlotOptions options;
  options.title = "Readings against the radiance that all cameras agree on";
  options.x_label = "exposure / that of white";
  options.y_label = "off by, %";
  options.x_axis = Axis::logarithmic;
  options.band = 1;
  return svg_plot(series, options);
}

std::string vignetting_plot(const recon::ColourCalibration& calibration) {
  PlotOptions options;
  options.title = "Vignetting: light from the middle to the corner";
  options.x_label = "distance from the middle, half diagonals";
  options.y_label = "share of the middle's light";
  return camera_curves(calibration, options, [](const recon::CalibratedColour& c, double r) {
    return recon::falloff(c.colour.vignetting, r * r);
  });
}

/// Light falloff over the picture (vignetting and flat field); white is the value in the middle.
std::string light_map(const recon::ColourCamera& camera, const recon::CalibratedColour& colour) {
  constexpr int kWidth = 160;
  const int height = std::clamp(kWidth * camera.size.height / std::max(1, camera.size.width), 16, 320);
  Image map(ImageLayout{{kWidth, height}, PixelFormat::rgb8, 8});
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double lens =
          recon::falloff(colour.colour.vignetting, recon::radius_squared({kWidth, height}, x + 0.5, y + 0.5));
      const auto flat = recon::light_at(colour.colour.flat, (x + 0.5) / kWidth, (y + 0.5) / height);
      for (std::size_t c = 0; c < 3; ++c)
        map.row_as<std::uint8_t>(y)[3 * static_cast<std::size_t>(x) + c] =
            static_cast<std::uint8_t>(std::lround(255 * std::clamp(lens * flat[c], 0.0, 1.0)));
    }
  return fmt::format("<img src=\"{}\" alt=\"\">", png_data_uri(map));
}

/// A patch's mean residual in each camera; or the reason why it has none, such as "saturated".
void patch_table(HtmlPage& page, const recon::ColourReadings& readings,
                 const recon::ColourCalibration& calibration) {
  struct Cell {
    double sum = 0;
    int used = 0;
    std::array<int, 4> uses = {};
  };
  std::map<std::string, std::vector<Cell>> patches;
  for (const recon::ColourResidual& r : calibration.residuals) {
    const recon::PatchReading& p = readings.patches[r.reading];
    if (recon::is_flat(p)) continue;
    auto& row = patches[p.light.empty() ? p.patch : p.patch + " @ " + p.light];
    row.resize(readings.cameras.size());
    Cell& cell = row[p.camera];
    ++cell.uses[static_cast<std::size_t>(r.use)];
    if (r.use != recon::ReadingUse::used) continue;
    cell.sum += r.relative;
    ++cell.used;
  }
  std::vector<std::string> header = {"patch"};
  for (const recon::ColourCamera& camera : readings.cameras) header.push_back(camera.id);
  std::vector<std::vector<std::string>> rows;
  constexpr std::array kWords = {"", "saturated", "too dark", "don't fit"};
  for (const auto& [name, cells] : patches) {
    std::vector<std::string> row = {name};
    for (const Cell& cell : cells) {
      std::string text = cell.used > 0 ? fmt::format("{:+.2f} %", 100 * cell.sum / cell.used) : "";
      for (std::size_t use = 1; use < kWords.size(); ++use)
        if (cell.uses[use] > 0)
          text += fmt::format("{}{} {}", text.empty() ? "" : ", ", cell.uses[use], kWords[use]);
      row.push_back(text.empty() ? "-" : text);
    }
    rows.push_back(std::move(row));
  }
  page.table(header, rows);
}

}  // namespace

std::string colour_report_page(const recon::ColourReadings& readings,
                               const recon::ColourCalibration& calibration) {
  HtmlPage page("Colour calibration");
  page.paragraph(
      fmt::format("{} cameras. Their readings of the same patches agree to {:.2f} % (RMS) after calibration. "
                  "Gains are relative to "
                  "the cameras' geometric mean, which is 1 in each channel: the picture of a scene has the "
                  "colours of the mean camera.",
                  calibration.cameras.size(), 100 * calibration.rms));
  if (!calibration.warnings.empty()) {
    page.heading("What isn't as it should be");
    for (const std::string& warning : calibration.warnings) page.paragraph(warning);
  }
  page.heading("What would improve it most");
  if (calibration.advice.empty()) page.paragraph("Nothing: every camera is known to half a per cent.");
  for (std::size_t i = 0; i < std::min<std::size_t>(5, calibration.advice.size()); ++i)
    page.paragraph(fmt::format("{}. {}", i + 1, calibration.advice[i]));
  page.heading("Cameras");
  page.table(
      {"camera", "gain R", "gain G", "gain B", "gamma", "light in the corner", "flat field beyond it",
       "dark level (G, of white)", "hot pixels", "RMS", "readings used / saturated / too dark / don't fit"},
      camera_rows(calibration));
  page.heading("Response").raw(response_plot(calibration));
  page.heading("Residuals").raw(residual_plot(readings, calibration));
  page.heading("Vignetting").raw(vignetting_plot(calibration));
  std::vector<HtmlPage::Picture> maps;
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i)
    if (calibration.cameras[i].vignetting_known || !calibration.cameras[i].colour.flat.light.empty())
      maps.push_back({light_map(readings.cameras[i], calibration.cameras[i]),
                      fmt::format("{}: {:.2f} in the corner", calibration.cameras[i].camera,
                                  calibration.cameras[i].corner)});
  if (!maps.empty()) page.gallery(maps);
  page.heading("Patches");
  page.paragraph(
      "What each camera makes of a patch, against what all agree on: the mean over its pictures and "
      "channels.");
  patch_table(page, readings, calibration);
  return page.str();
}

}  // namespace emberlock::report
