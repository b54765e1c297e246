// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "base/file.h"
#include "cli/black_body.h"
#include "cli/commands.h"
#include "cli/outputs.h"
#include "recon/preprocess/colour_calibration.h"
#include "report/colour_report.h"
#include "session/rig_file.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

struct ColourArguments {
  std::vector<std::string> inputs;  ///< a folder, or pictures of a black body
  std::string out;
  std::string rig;
  std::optional<double> gamma;
  BlackBodyArguments black_body;
};

/// Stores the colours in the rig's cameras; missing cameras are added with only their colour.
Status put_colours(v1::Rig& rig, const recon::ColourReadings& readings,
                   const recon::ColourCalibration& calibration) {
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i) {
    const recon::ColourCamera& from = readings.cameras[i];
    auto* cameras = rig.mutable_cameras();
    auto camera = std::find_if(cameras->begin(), cameras->end(),
                               [&](const v1::RigCamera& c) { return c.camera_id() == from.id; });
    if (camera != cameras->end() && (static_cast<int>(camera->width()) != from.size.width ||
                                     static_cast<int>(camera->height()) != from.size.height)) {
      return Error{ErrorKind::bad_input,
                   fmt::format("was calibrated with {} x {} pixels, its target pictures have {} x {}",
                               camera->width(), camera->height(), from.size.width, from.size.height),
                   "camera " + from.id,
                   "Take the target's pictures with the settings that the camera films with"};
    }
    v1::RigCamera* into = camera != cameras->end() ? &*camera : rig.add_cameras();
    into->set_camera_id(from.id);
    into->set_width(static_cast<std::uint32_t>(from.size.width));
    into->set_height(static_cast<std::uint32_t>(from.size.height));
    if (into->colour().has_spectral())
      std::printf(
          "%-16s the spectral response of %s was of its earlier gains and was removed: find it again with "
          "--black-body\n",
          "note", from.id.c_str());
    *into->mutable_colour() = recon::to_message(calibration.cameras[i].colour);
  }
  return {};
}

void print_summary(const recon::ColourCalibration& calibration) {
  for (const recon::CalibratedColour& c : calibration.cameras) {
    const auto& g = c.colour.gain;
    std::printf(
        "%-16s gain %.4f %.4f %.4f%s, gamma %.3f, corner %.3f%s, %zu hot pixels, off by %.2f %% RMS\n",
        c.camera.c_str(), g[0], g[1], g[2],
        c.shares_patches
            ? fmt::format(" (± {:.2f} %)", 100 * *std::max_element(c.gain_sigma.begin(), c.gain_sigma.end()))
                  .c_str()
            : " (not known)",
        c.gamma, c.corner, c.vignetting_known ? "" : " (not known)", c.colour.hot_pixels.size(), 100 * c.rms);
  }
  for (const std::string& warning : calibration.warnings)
    std::printf("%-16s %s\n", "warning", warning.c_str());
  if (!calibration.advice.empty())
    std::printf("%-16s %s\n", "next picture", calibration.advice.front().c_str());
}

Status calibrate_folder(const ColourArguments& arguments) {
  OutputRequest where{arguments.out, kCalibrateColour, {arguments.inputs.front()}};
  if (!arguments.rig.empty()) where.updated.emplace_back(arguments.rig);
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(where));
  EMBERLOCK_ASSIGN_OR_RETURN(
      const recon::ColourReadings readings,
      recon::read_colour_folder(arguments.inputs.front(), progress_bar("calibrate colour")));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::ColourCalibration calibration,
                             recon::calibrate_colour(readings, {.gamma = arguments.gamma}));
  v1::Rig rig;
  if (!arguments.rig.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(rig, session::read_rig(arguments.rig));
  } else {
    rig.set_format_version(session::kRigFormatVersion);
  }
  EMBERLOCK_RETURN_IF_ERROR(put_colours(rig, readings, calibration));
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder staging, OutputFolder::create(where));
  EMBERLOCK_RETURN_IF_ERROR(session::write_rig(staging.path() / "rig.json", rig));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "colour.html",
                                                  report::colour_report_page(readings, calibration)));
  EMBERLOCK_RETURN_IF_ERROR(staging.commit());
  print_summary(calibration);
  std::printf("%-16s %s\n", "written to", (fs::path(arguments.out) / "rig.json").c_str());
  return {};
}

Status calibrate(const ColourArguments& arguments) {
  if (arguments.black_body.temperatures.empty()) {
    if (arguments.inputs.size() == 1) return calibrate_folder(arguments);
    return Error{ErrorKind::bad_input, "several folders are named", arguments.inputs[1],
                 "Name one; pictures of a black body need --black-body"};
  }
  BlackBodyArguments black_body = arguments.black_body;
  black_body.pictures = arguments.inputs;
  black_body.out = arguments.out;
  black_body.rig = arguments.rig;
  black_body.gamma = arguments.gamma;
  return calibrate_black_body(black_body);
}

void add_black_body_options(const Verb& verb, BlackBodyArguments& a) {
  const Option temperatures = verb.add_option(
      "--black-body", a.temperatures,
      "T[,T2...]: finds the spectral response and its absolute scale instead, from one picture for each of "
      "these true temperatures in K (500 to 6000)");
  verb.add_option("--emitter", a.emitter,
                  "What glows: furnace (emissivity 1), tungsten (a ribbon), or its emissivity")
      .show_default()
      .need(temperatures);
  verb.add_option("--window", a.window,
                  "Share of the light that a lamp's glass, or other windows, let through")
      .check_range(0.01, 1.0)
      .show_default()
      .need(temperatures);
  verb.add_option("--temperature-sigma", a.temperature_sigma, "Standard error of each temperature, K")
      .check_range(0.0, 500.0)
      .show_default()
      .need(temperatures);
  verb.add_option("--region", a.region, "x,y,width,height: where it glows [the brightest even rectangle]")
      .need(temperatures);
  verb.add_option("--dark", a.dark, "A picture without light, which is subtracted [black is 0]")
      .need(temperatures);
  verb.add_option("--base", a.base,
                  "The response that is scaled, shifted and widened: srgb (a camera that shows linear sRGB), "
                  "sensor (the same without negative lobes), or a response.json")
      .show_default()
      .need(temperatures);
  verb.add_option("--exposure", a.exposures,
                  "Exposure time of the pictures in s, or one for each: S1,S2,... The response holds at the "
                  "first; rig.json keeps it [all alike]")
      .need(temperatures);
  verb.add_option("--camera", a.camera,
                  "With --rig: the camera that took the pictures; its gains and vignetting are applied, and "
                  "it gets the response [the only one]")
      .need(temperatures);
}

}  // namespace

void add_calibrate_colour(const Verb& parent) {
  auto arguments = std::make_shared<ColourArguments>();
  const Verb verb = parent.add_verb(
      "colour",
      "Responses, gains between cameras, vignetting and dark levels, from pictures of one target; with "
      "--black-body a camera's spectral response, from pictures of a furnace or lamp of known temperatures");
  ColourArguments& a = *arguments;
  verb.add_option(
          "folder", a.inputs,
          "Folder with colour.json (where the patches are) and a subfolder per camera with its pictures "
          "target[_LIGHT][_SECONDSs], flat and dark; or with a session, whose frames colour.json names so. "
          "With --black-body: pictures")
      .require();
  verb.add_option("--out", a.out,
                  "Folder for rig.json and colour.html, the report; with --black-body for response.json, "
                  "response.html and, with --rig, rig.json")
      .require();
  verb.add_option("--rig", a.rig, "A rig.json to add the colours to [a new one with the colours only]");
  verb.add_option(
          "--gamma", a.gamma,
          "Exponent of the power law that is the cameras' response [found from exposures or radiances; "
          "with --black-body linear]")
      .check_range(0.3, 5.0);
  add_black_body_options(verb, a.black_body);
  verb.set_action([arguments] { or_fail(calibrate(*arguments)); });
}

}  // namespace emberlock::cli
