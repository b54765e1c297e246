// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include <fmt/format.h>

#include "base/file.h"
#include "cli/commands.h"
#include "cli/outputs.h"
#include "recon/preprocess/colour_calibration.h"
#include "report/colour_report.h"
#include "session/rig_file.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

struct ColourArguments {
  std::string folder;
  std::string out;
  std::string rig;
  std::optional<double> gamma;
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
  OutputRequest where{arguments.out, kCalibrateColour, {arguments.folder}};
  if (!arguments.rig.empty()) where.updated.emplace_back(arguments.rig);
  EMBERLOCK_RETURN_IF_ERROR(OutputFolder::check(where));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::ColourReadings readings,
                             recon::read_colour_folder(arguments.folder, progress_bar("calibrate colour")));
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

}  // namespace

void add_calibrate_colour(CLI::App& parent) {
  auto arguments = std::make_shared<ColourArguments>();
  CLI::App* verb = parent.add_subcommand(
      "colour", "Responses, gains between cameras, vignetting and dark levels, from pictures of one target");
  ColourArguments& a = *arguments;
  verb->add_option(
          "folder", a.folder,
          "Folder with colour.json (where the patches are) and a subfolder per camera with its pictures "
          "target[_LIGHT][_SECONDSs], flat and dark; or with a session, whose frames colour.json names so")
      ->required();
  verb->add_option("--out", a.out, "Folder for rig.json and colour.html, the report")->required();
  verb->add_option("--rig", a.rig, "A rig.json to add the colours to [a new one with the colours only]");
  verb->add_option(
          "--gamma", a.gamma,
          "Exponent of the power law that is the cameras' response [found from exposures or radiances]")
      ->check(CLI::Range(0.3, 5.0));
  verb->callback([arguments] { or_fail(calibrate_folder(*arguments)); });
}

}  // namespace emberlock::cli
