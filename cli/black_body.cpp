// SPDX-License-Identifier: Apache-2.0
#include "cli/black_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "base/file.h"
#include "cli/commands.h"
#include "cli/numbers.h"
#include "cli/outputs.h"
#include "recon/calibrate/rig.h"
#include "recon/preprocess/glow_region.h"
#include "recon/temperature/response_fit.h"
#include "report/response_report.h"
#include "session/media/frame_file.h"
#include "session/rig_file.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

constexpr std::array<const char*, 3> kChannelLetters = {"R", "G", "B"};

Error not_understood(const std::string& text, const char* option, const char* remedy) {
  return {ErrorKind::bad_input, "\"" + text + "\" isn't understood", option, remedy};
}

Result<std::optional<recon::PatchPlace>> parse_region(const std::string& text) {
  if (text.empty()) return std::optional<recon::PatchPlace>{};
  constexpr const char* kRemedy = "Give x,y,width,height in whole pixels";
  const auto n = parse_numbers_of<4>(text);
  if (!n ||
      !std::all_of(n->begin(), n->end(), [](double v) { return v >= 0 && v < 1e6 && v == std::floor(v); }))
    return not_understood(text, "--region", kRemedy);
  return std::optional(recon::PatchPlace{static_cast<int>((*n)[0]), static_cast<int>((*n)[1]),
                                         static_cast<int>((*n)[2]), static_cast<int>((*n)[3])});
}

Result<recon::CameraResponse> base_of(const std::string& word) {
  if (word == "srgb") return recon::standard_response();
  if (word == "sensor") return recon::sensor_response();
  return recon::read_camera_response(word);
}

/// The camera of the rig that took the pictures; null without a rig.
Result<v1::RigCamera*> camera_of(v1::Rig& rig, const BlackBodyArguments& arguments) {
  if (arguments.rig.empty()) return nullptr;
  std::string known;
  for (v1::RigCamera& camera : *rig.mutable_cameras()) {
    if (camera.camera_id() == arguments.camera || (arguments.camera.empty() && rig.cameras_size() == 1))
      return &camera;
    known += (known.empty() ? "" : ", ") + camera.camera_id();
  }
  return Error{
      ErrorKind::bad_input,
      arguments.camera.empty() ? "the rig has several cameras" : "the rig has no camera " + arguments.camera,
      "--camera", "Name the one that took the pictures: " + known};
}

/// A response of a power law.
recon::Colour power_law(double gamma) {
  constexpr int kPoints = 4097;
  recon::Colour colour;
  for (int i = 0; i < kPoints; ++i)
    colour.response.push_back(std::pow(static_cast<double>(i) / (kPoints - 1), gamma));
  return colour;
}

/// Of each picture, s; nothing where they aren't told.
Result<std::vector<double>> exposures_of(const BlackBodyArguments& arguments) {
  if (arguments.exposures.empty()) return std::vector<double>{};
  constexpr const char* kRemedy =
      "Give one exposure time in s for all pictures, or one for each: 0.004,0.001";
  auto told = parse_numbers(arguments.exposures);
  if (!told) return not_understood(arguments.exposures, "--exposure", kRemedy);
  std::vector<double>& seconds = *told;
  const bool fits = seconds.size() == 1 || seconds.size() == arguments.pictures.size();
  if (!fits || !std::all_of(seconds.begin(), seconds.end(), [](double s) { return s >= 1e-6 && s <= 3600; }))
    return Error{ErrorKind::bad_input, "\"" + arguments.exposures + "\" doesn't fit", "--exposure", kRemedy};
  seconds.resize(arguments.pictures.size(), seconds.front());
  return std::move(seconds);
}

/// What the picture had shown at an exposure so many times as long.
recon::GlowReading exposed(recon::GlowReading reading, double times) {
  for (std::size_t c = 0; c < 3; ++c) {
    reading.level[c] *= times;
    reading.sigma[c] *= times;
  }
  return reading;
}

Status read_sources(const BlackBodyArguments& arguments, const v1::RigCamera* camera,
                    std::vector<report::GlowSource>& out) {
  const auto told = parse_numbers(arguments.temperatures);
  if (!told)
    return not_understood(arguments.temperatures, "--black-body", "Give temperatures in kelvin: 1500,1800");
  const std::vector<double>& kelvin = *told;
  if (kelvin.size() != arguments.pictures.size())
    return Error{ErrorKind::bad_input,
                 fmt::format("{} temperature(s), {} picture(s)", kelvin.size(), arguments.pictures.size()),
                 "--black-body", "Give one picture for each temperature, in the same order"};
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<double> exposures, exposures_of(arguments));
  recon::GlowPictureOptions options;
  EMBERLOCK_ASSIGN_OR_RETURN(options.region, parse_region(arguments.region));
  if (arguments.gamma) options.colour = power_law(*arguments.gamma);
  std::optional<Image> dark;
  if (!arguments.dark.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(dark, session::read_image(arguments.dark));
    options.dark = &*dark;
  }
  for (std::size_t i = 0; i < kelvin.size(); ++i) {
    const std::string& name = arguments.pictures[i];
    EMBERLOCK_ASSIGN_OR_RETURN(const Image picture, session::read_image(name));
    const ImageSize size = picture.layout().size;
    if (camera != nullptr) {
      if (static_cast<int>(camera->width()) != size.width ||
          static_cast<int>(camera->height()) != size.height)
        return Error{ErrorKind::bad_input,
                     fmt::format("has {} x {} pixels, camera {} was calibrated with {} x {}", size.width,
                                 size.height, camera->camera_id(), camera->width(), camera->height()),
                     name, "Take the pictures with the settings that the camera films with"};
      if (camera->has_colour()) {
        EMBERLOCK_ASSIGN_OR_RETURN(
            options.colour, recon::read_colour(camera->colour(), size, "camera " + camera->camera_id()));
      }
    }
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::GlowPicture glow,
                               recon::read_glow(picture.view(), options, name));
    const recon::GlowReading reading{Kelvin(kelvin[i]), glow.level, glow.sigma, glow.saturated};
    const double times = exposures.empty() ? 1 : exposures.front() / exposures[i];
    out.push_back({fs::path(name).filename().string(), glow.region, exposed(reading, times)});
  }
  return {};
}

void print_fit(const std::vector<report::GlowSource>& sources, const recon::ResponseFit& fit,
               const recon::CameraResponse& base) {
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const report::GlowSource& s = sources[i];
    std::printf("%-12s %g K, region %d,%d,%d,%d:", s.name.c_str(), s.reading.temperature.value(), s.region.x,
                s.region.y, s.region.width, s.region.height);
    for (std::size_t c = 0; c < 3; ++c)
      std::printf(" %s %.2f ± %.2f%s (fit %.2f)", kChannelLetters[c], s.reading.level[c], s.reading.sigma[c],
                  s.reading.saturated[c] ? " or more" : "", fit.predicted[i][c]);
    std::printf("\n");
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const auto words = report::channel_words(fit.channels[c]);
    std::printf("%-12s %s; %s; %s\n", kChannelLetters[c], words[0].c_str(), words[1].c_str(),
                words[2].c_str());
  }
  for (const double kelvin : {1600.0, 2000.0}) {
    const auto e = recon::level_errors(fit, base, Kelvin(kelvin));
    std::printf("%-12s a black body's levels are known to ± %.1f, %.1f and %.1f %%\n",
                fmt::format("{:g} K", kelvin).c_str(), 100 * e[0], 100 * e[1], 100 * e[2]);
  }
  std::printf("%-12s %.1f, %d expected\n", "chi-square", fit.chi_square, fit.freedom);
  for (const std::string& warning : fit.warnings) std::printf("%-12s %s\n", "warning", warning.c_str());
}

/// One response for all cameras, since their pictures are equalised to one radiance.
void put_response(v1::Rig& rig, v1::RigCamera& camera, const recon::CameraResponse& response,
                  const std::vector<double>& exposures) {
  for (v1::RigCamera& other : *rig.mutable_cameras()) {
    if (!other.colour().has_spectral()) continue;
    other.mutable_colour()->clear_spectral();
    other.mutable_colour()->clear_exposure_s();
    if (&other != &camera)
      std::printf("%-12s camera %s's earlier response was removed: this one is of all cameras\n", "note",
                  other.camera_id().c_str());
  }
  *camera.mutable_colour()->mutable_spectral() = recon::message_of(response);
  if (!exposures.empty()) camera.mutable_colour()->set_exposure_s(exposures.front());
}

}  // namespace

Status calibrate_black_body(const BlackBodyArguments& arguments) {
  OutputRequest where{
      arguments.out, kCalibrateResponse, {arguments.pictures.begin(), arguments.pictures.end()}};
  if (!arguments.dark.empty()) where.inputs.emplace_back(arguments.dark);
  if (!arguments.rig.empty()) where.updated.emplace_back(arguments.rig);
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(where));
  v1::Rig rig;
  if (!arguments.rig.empty()) {
    if (arguments.gamma)
      return Error{ErrorKind::bad_input, "the rig says how its cameras' samples tell light", "--gamma",
                   "Leave it out, or leave --rig out"};
    EMBERLOCK_ASSIGN_OR_RETURN(rig, session::read_rig(arguments.rig));
  }
  EMBERLOCK_ASSIGN_OR_RETURN(v1::RigCamera* const camera, camera_of(rig, arguments));
  recon::ResponseFitOptions options;
  EMBERLOCK_ASSIGN_OR_RETURN(options.emitter, recon::parse_known_emitter(arguments.emitter));
  options.emitter.window = arguments.window;
  options.temperature_sigma = Kelvin(arguments.temperature_sigma);
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::CameraResponse base, base_of(arguments.base));
  std::vector<report::GlowSource> sources;
  EMBERLOCK_RETURN_IF_ERROR(read_sources(arguments, camera, sources));
  std::vector<recon::GlowReading> readings;
  readings.reserve(sources.size());
  for (const report::GlowSource& source : sources) readings.push_back(source.reading);
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::ResponseFit fit, recon::fit_response(readings, base, options));
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder staging, OutputFolder::create(where));
  EMBERLOCK_RETURN_IF_ERROR(
      write_file_atomically(staging.path() / "response.json", recon::to_json(fit.response)));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "response.html",
                                                  report::response_report_page(sources, fit, base)));
  if (camera != nullptr) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<double> exposures, exposures_of(arguments));
    put_response(rig, *camera, fit.response, exposures);
    EMBERLOCK_RETURN_IF_ERROR(session::write_rig(staging.path() / "rig.json", rig));
  }
  EMBERLOCK_RETURN_IF_ERROR(staging.commit());
  print_fit(sources, fit, base);
  std::printf("%-12s %s\n", "written to", (fs::path(arguments.out) / "response.json").c_str());
  return {};
}

}  // namespace emberlock::cli
