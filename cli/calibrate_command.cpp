// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "base/file.h"
#include "cli/board_options.h"
#include "cli/commands.h"
#include "cli/outputs.h"
#include "cli/rig_argument.h"
#include "cli/scene_options.h"
#include "films/board_search.h"
#include "recon/calibrate/calibrate_rig.h"
#include "recon/calibrate/next_pictures.h"
#include "recon/calibrate/rig_formats.h"
#include "report/calibrate_report.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

constexpr double kDegreesOfRadian = 180 / M_PI;

/// The command line as typed.
struct CamerasArguments {
  films::BoardArguments boards;
  std::string out;
  std::string world;
  std::string box;
  bool json = false;
};

/// Keeps the colour of an earlier calibration in the same folder.
void keep_colour(v1::Rig& rig, const fs::path& earlier) {
  std::error_code ec;
  if (!fs::exists(earlier, ec)) return;
  const auto old = session::read_rig(earlier);
  if (!old) return;
  for (v1::RigCamera& camera : *rig.mutable_cameras())
    for (const v1::RigCamera& known : old->cameras())
      if (known.camera_id() == camera.camera_id() && known.has_colour())
        *camera.mutable_colour() = known.colour();
}

nlohmann::json calibration_json(const recon::BoardReading& reading,
                                const recon::RigCalibration& calibration) {
  nlohmann::json cameras = nlohmann::json::array();
  for (const recon::CalibratedCamera& camera : calibration.cameras) {
    nlohmann::json entry = {{"camera", camera.id},      {"calibrated", camera.calibrated},
                            {"placed", camera.placed},  {"why", camera.why},
                            {"views", camera.views},    {"views_used", camera.views_used},
                            {"rms_pixels", camera.rms}, {"noise_pixels", camera.fit.noise}};
    if (camera.calibrated) {
      const recon::Intrinsics& in = camera.fit.model.intrinsics;
      entry["fx"] = in.fx;
      entry["fx_sigma"] = camera.sigma[0];
      entry["fy"] = in.fy;
      entry["fy_sigma"] = camera.sigma[1];
    }
    cameras.push_back(std::move(entry));
  }
  nlohmann::json rejected = nlohmann::json::array();
  for (const auto& view : calibration.rejected)
    rejected.push_back({{"picture", reading.sightings.sightings[view.sighting].picture}, {"why", view.why}});
  for (const auto& picture : reading.unused)
    rejected.push_back({{"picture", picture.path.string()}, {"why", picture.why}});
  nlohmann::json result = {{"rms_pixels", recon::rms_of(calibration.bundle)},
                           {"world", calibration.world},
                           {"cameras", cameras},
                           {"left_out", rejected},
                           {"take_next", recon::next_pictures(calibration)}};
  if (reading.film) {
    const recon::FilmCounts& film = *reading.film;
    result["film"] = {{"instants", film.instants},
                      {"searched", film.looked},
                      {"seen", film.seen},
                      {"moving", film.moving},
                      {"taken", film.taken}};
  }
  return result;
}

void print_cameras(const recon::BoardReading& reading, const recon::RigCalibration& calibration,
                   const std::string& out) {
  if (reading.film) std::printf("%s\n", films::film_words(reading).c_str());
  std::printf("%s\n", report::calibration_words(reading, calibration).c_str());
  for (const recon::CalibratedCamera& camera : calibration.cameras) {
    if (!camera.placed) {
      std::printf("%-12s %s. %s.\n", camera.id.c_str(), camera.calibrated ? "lens only" : "not calibrated",
                  camera.why.c_str());
      continue;
    }
    std::printf(
        "%-12s %3zu of %3zu views  %.3f px RMS  f %.1f +- %.1f px  place +- %.2f mm  turn +- %.3f degrees\n",
        camera.id.c_str(), camera.views_used, camera.views, camera.rms, camera.fit.model.intrinsics.fx,
        camera.sigma[0], camera.sigma.segment<3>(9).maxCoeff() * 1e3,
        camera.sigma.segment<3>(12).maxCoeff() * kDegreesOfRadian);
  }
  for (const auto& view : calibration.rejected)
    std::printf("left out     %s: %s\n", reading.sightings.sightings[view.sighting].picture.c_str(),
                view.why.c_str());
  for (const auto& picture : reading.unused)
    std::printf("left out     %s: %s\n", picture.path.c_str(), picture.why.c_str());
  for (const std::string& sentence : recon::next_pictures(calibration))
    std::printf("take next    %s\n", sentence.c_str());
  std::printf("written to   %s\n", (fs::path(out) / "index.html").c_str());
}

Result<recon::CalibrateOptions> calibrate_options(const CamerasArguments& arguments) {
  recon::CalibrateOptions options;
  if (!arguments.world.empty()) options.world = arguments.world;
  if (!arguments.box.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.box, parse_box(arguments.box));
  }
  return options;
}

void calibrate_cameras(const CamerasArguments& arguments) {
  const recon::CalibrateOptions options = or_fail(calibrate_options(arguments));
  const recon::Board board = or_fail(recon::parse_board(arguments.boards.board));
  OutputFolder staging =
      or_fail(OutputFolder::create({arguments.out,
                                    kCalibrateCameras,
                                    {arguments.boards.pictures.begin(), arguments.boards.pictures.end()}}));
  const Progress bar = progress_bar("calibrate");
  const recon::BoardReading reading = or_fail(
      films::read_boards(arguments.boards, recon::search_for(board),
                         [&](double fraction, std::string_view what) { tell(bar, 0.6 * fraction, what); }));
  const recon::RigCalibration calibration =
      or_fail(recon::calibrate_rig(reading.sightings, options, [&](double fraction, std::string_view what) {
        tell(bar, 0.6 + 0.4 * fraction, what);
      }));
  tell(bar, 1, "done");
  v1::Rig rig = recon::rig_of(calibration, utc_now());
  keep_colour(rig, fs::path(arguments.out) / "rig.json");
  or_fail(recon::export_rig(rig, staging.path()));
  or_fail(
      write_file_atomically(staging.path() / "index.html", report::calibration_html(reading, calibration)));
  or_fail(staging.commit());
  if (arguments.json) {
    std::printf("%s\n", calibration_json(reading, calibration).dump().c_str());
  } else {
    print_cameras(reading, calibration, arguments.out);
  }
  if (!calibration.whole()) throw Exit(1);
}

void add_cameras(const Verb& parent) {
  auto arguments = std::make_shared<CamerasArguments>();
  const Verb verb = parent.add_verb("cameras",
                                    "Lenses and poses of all cameras from pictures or films of a board; "
                                    "exit code 1 if a camera's pose couldn't be found");
  CamerasArguments& a = *arguments;
  add_board_options(verb, a.boards, recon::FilmSearchOptions{}.instants);
  verb.find_option("--board").require();
  verb.add_option("--out", a.out, "Folder for rig.json, index.html, transforms.json, opencv/ and colmap/")
      .require();
  verb.add_option("--world", a.world,
                  "Instant whose board sets the world frame: origin at its first corner, x along a row, z "
                  "out of the board [the first instant that most cameras see]");
  verb.add_option(
      "--box", a.box,
      "cx,cy,cz,sx,sy,sz: the flame's volume in that world, metres [the largest cube that all cameras see]");
  verb.add_flag("--json", a.json, "One JSON object on stdout");
  verb.set_action([arguments] { calibrate_cameras(*arguments); });
}

void add_convert(const Verb& parent) {
  struct Arguments {
    std::string rig;
    std::string out;
  };
  auto arguments = std::make_shared<Arguments>();
  const Verb verb = parent.add_verb(
      "convert", "Converts another program's calibration to rig.json, and rig.json for other programs");
  verb.add_option(
          "rig", arguments->rig,
          "rig.json, transforms.json, OpenCV's or ROS' YAML, XML or JSON (a file, or a folder of them), "
          "Kalibr's camchain, or a folder with COLMAP's model (also in sparse/0)")
      .require();
  verb.add_option("--out", arguments->out, "Folder for rig.json, transforms.json, opencv/ and colmap/")
      .require();
  verb.set_action([arguments] {
    const v1::Rig rig = or_fail(import_rig_argument(arguments->rig));
    OutputFolder staging =
        or_fail(OutputFolder::create({arguments->out, kCalibrateConvert, {arguments->rig}}));
    or_fail(recon::export_rig(rig, staging.path()));
    or_fail(staging.commit());
    std::printf("%d cameras written to %s\n", rig.cameras_size(), arguments->out.c_str());
  });
}

}  // namespace

void add_calibrate(const Verb& app) {
  const Verb verb =
      app.add_verb("calibrate", "Poses, lenses and colours of the cameras, and whether a camera moved");
  verb.require_verb();
  add_cameras(verb);
  add_calibrate_check(verb);
  add_convert(verb);
  add_calibrate_colour(verb);
}

}  // namespace emberlock::cli
