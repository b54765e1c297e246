// SPDX-License-Identifier: Apache-2.0
#include "report/response_report.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "report/html.h"

namespace emberlock::report {
namespace {

constexpr std::array<const char*, 3> kChannelNames = {"red", "green", "blue"};
constexpr std::array<std::size_t, 3> kChannelColours = {1, 2, 0};  // of the palette: red, green, blue

double largest_level(const recon::CameraResponse& response) {
  double most = 0;
  for (const auto& channel : response.level)
    for (const double v : channel) most = std::max(most, std::abs(v));
  return most;
}

std::string spectral_plot(const recon::CameraResponse& response, const recon::CameraResponse& base) {
  std::vector<Series> series;
  const double scale = largest_level(response) / largest_level(base);
  for (std::size_t c = 0; c < 3; ++c) {
    series.push_back({kChannelNames[c], response.wavelength_nm, response.level[c]});
    series.back().colour = kChannelColours[c];
  }
  for (std::size_t c = 0; c < 3; ++c) {
    series.push_back({std::string("base, ") + kChannelNames[c], base.wavelength_nm, base.level[c]});
    for (double& v : series.back().y) v *= scale;
    series.back().colour = kChannelColours[c];
    series.back().dashed = true;
  }
  PlotOptions options;
  options.title = "Response, and the base scaled to it";
  options.x_label = "wavelength, nm";
  options.y_label = "levels per W / (sr m²)";
  return svg_plot_for_any_width(series, options);
}

std::vector<std::vector<std::string>> source_rows(const std::vector<GlowSource>& sources,
                                                  const recon::ResponseFit& fit) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const GlowSource& source = sources[i];
    std::vector<std::string> row = {source.name, fmt::format("{:g} K", source.reading.temperature.value()),
                                    fmt::format("{} × {} at {}, {}", source.region.width,
                                                source.region.height, source.region.x, source.region.y)};
    for (std::size_t c = 0; c < 3; ++c)
      row.push_back(fmt::format("{:.2f} ± {:.2f}{}, fit {:.2f}", source.reading.level[c],
                                source.reading.sigma[c], source.reading.saturated[c] ? " or more" : "",
                                fit.predicted[i][c]));
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace

std::vector<std::string> channel_words(const recon::FittedChannel& channel) {
  if (channel.dead) return {"no light seen: response 0", "-", "-"};
  const auto by = [](const recon::FittedNumber& number) {
    return fmt::format("{:.0f} % by the pictures", 100 * number.by_data);
  };
  return {fmt::format("peak {:.4g} levels per W/(sr m2) at {:.0f} nm, scale {:.4g} ± {:.1f} %", channel.peak,
                      channel.peak_nm, channel.scale.value, 100 * channel.scale.sigma),
          fmt::format("shift {:+.1f} ± {:.1f} nm ({})", channel.shift.value, channel.shift.sigma,
                      by(channel.shift)),
          fmt::format("width {:.3f} ± {:.1f} % ({})", channel.width.value, 100 * channel.width.sigma,
                      by(channel.width))};
}

std::string response_report_page(const std::vector<GlowSource>& sources, const recon::ResponseFit& fit,
                                 const recon::CameraResponse& base) {
  HtmlPage page("Spectral response");
  page.paragraph(
      fmt::format("From {} picture{} of an emitter of known temperature. Chi-square {:.1f}, {} expected.",
                  sources.size(), sources.size() == 1 ? "" : "s", fit.chi_square, fit.freedom));
  for (const std::string& warning : fit.warnings) page.paragraph("Warning: " + warning);
  page.raw(spectral_plot(fit.response, base));
  std::vector<std::vector<std::string>> rows;
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<std::string> row = channel_words(fit.channels[c]);
    row.insert(row.begin(), kChannelNames[c]);
    rows.push_back(std::move(row));
  }
  page.heading("Each channel")
      .paragraph(
          "The base's channel, shifted, widened about its middle and scaled. Before any picture a shift of "
          "10 nm and a width of 15 % are assumed; what the pictures didn't tell is still that.")
      .table({"channel", "scale", "shift", "width"}, rows);
  rows.clear();
  for (const double kelvin : {1200.0, 1600.0, 2000.0, 2400.0}) {
    const auto errors = recon::level_errors(fit, base, Kelvin(kelvin));
    rows.push_back({fmt::format("{:g} K", kelvin)});
    for (const double e : errors) rows.back().push_back(e > 0 ? fmt::format("± {:.1f} %", 100 * e) : "-");
  }
  page.heading("How well a black body's level is known").table({"", "red", "green", "blue"}, rows);
  page.heading("Pictures")
      .paragraph("Levels as the first picture's exposure would show them.")
      .table({"picture", "temperature", "region", "red", "green", "blue"}, source_rows(sources, fit));
  return page.str();
}

}  // namespace emberlock::report
