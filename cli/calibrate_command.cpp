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
#include "cli/calibrate_report.h"
#include "cli/commands.h"
#include "cli/scene_options.h"
#include "recon/calibrate/board_pictures.h"
#include "recon/calibrate/calibrate_rig.h"
#include "recon/calibrate/drift.h"
#include "recon/calibrate/next_pictures.h"
#include "recon/calibrate/rig_formats.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

constexpr const char* kRigMarker = "rig.json";
constexpr double kDegreesOfRadian = 180 / M_PI;

/// The command line as typed.
struct CamerasArguments {
  std::vector<std::string> pictures;
  std::string board;
  std::string out;
  std::string world;
  std::string box;
  bool json = false;
};

/// The colour that an earlier calibration in the same folder knew stays.
void keep_colour(v1::Rig& rig, const fs::path& earlier) {
  std::error_code ec;
  if (!fs::exists(earlier, ec)) return;
  const auto old = read_rig(earlier);
  if (!old) return;
  for (v1::RigCamera& camera : *rig.mutable_cameras())
    for (const v1::RigCamera& known : old->cameras())
      if (known.camera_id() == camera.camera_id() && known.has_colour())
        *camera.mutable_colour() = known.colour();
}

nlohmann::json calibration_json(const BoardReading& reading, const RigCalibration& calibration) {
  nlohmann::json cameras = nlohmann::json::array();
  for (const CalibratedCamera& camera : calibration.cameras) {
    nlohmann::json entry = {{"camera", camera.id},      {"calibrated", camera.calibrated},
                            {"placed", camera.placed},  {"why", camera.why},
                            {"views", camera.views},    {"views_used", camera.views_used},
                            {"rms_pixels", camera.rms}, {"noise_pixels", camera.fit.noise}};
    if (camera.calibrated) {
      const Intrinsics& in = camera.fit.model.intrinsics;
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
  return {{"rms_pixels", rms_of(calibration.bundle)},
          {"world", calibration.world},
          {"cameras", cameras},
          {"left_out", rejected},
          {"take_next", next_pictures(calibration)}};
}

void print_cameras(const BoardReading& reading, const RigCalibration& calibration, const std::string& out) {
  std::printf("%s\n", calibration_words(reading, calibration).c_str());
  for (const CalibratedCamera& camera : calibration.cameras) {
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
  for (const std::string& sentence : next_pictures(calibration))
    std::printf("take next    %s\n", sentence.c_str());
  std::printf("written to   %s\n", (fs::path(out) / "index.html").c_str());
}

Result<CalibrateOptions> calibrate_options(const CamerasArguments& arguments) {
  CalibrateOptions options;
  if (!arguments.world.empty()) options.world = arguments.world;
  if (!arguments.box.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.box, parse_box(arguments.box));
  }
  return options;
}

/// The board's corners in all pictures; `share` of the bar is theirs.
BoardReading read_boards(const std::vector<std::string>& inputs, const std::string& board_text,
                         const Progress& bar, double share) {
  const Board board = or_fail(parse_board(board_text));
  const auto pictures = or_fail(list_board_pictures({inputs.begin(), inputs.end()}));
  return or_fail(find_boards(
      pictures, board, [&](double fraction, std::string_view what) { report(bar, share * fraction, what); }));
}

void calibrate_cameras(const CamerasArguments& arguments) {
  const CalibrateOptions options = or_fail(calibrate_options(arguments));
  or_fail(parse_board(arguments.board));
  AtomicDirectory staging = or_fail(AtomicDirectory::create(arguments.out, kRigMarker));
  const Progress bar = progress_bar("calibrate");
  const BoardReading reading = read_boards(arguments.pictures, arguments.board, bar, 0.6);
  const RigCalibration calibration =
      or_fail(calibrate_rig(reading.sightings, options, [&](double fraction, std::string_view what) {
        report(bar, 0.6 + 0.4 * fraction, what);
      }));
  report(bar, 1, "done");
  v1::Rig rig = rig_of(calibration, utc_now());
  keep_colour(rig, fs::path(arguments.out) / kRigMarker);
  or_fail(export_rig(rig, staging.path()));
  or_fail(write_file_atomically(staging.path() / "index.html", calibration_html(reading, calibration)));
  or_fail(staging.commit());
  if (arguments.json) {
    std::printf("%s\n", calibration_json(reading, calibration).dump().c_str());
  } else {
    print_cameras(reading, calibration, arguments.out);
  }
  if (!calibration.whole()) throw CLI::RuntimeError(1);
}

void add_cameras(CLI::App& parent) {
  auto arguments = std::make_shared<CamerasArguments>();
  CLI::App* verb = parent.add_subcommand(
      "cameras",
      "Lenses and poses of all cameras from pictures of a board; 1 if one of them couldn't be placed");
  CamerasArguments& a = *arguments;
  verb->add_option(
          "pictures", a.pictures,
          "A folder with a subfolder a camera, in which pictures of one instant have one number; or pictures "
          "named by camera and instant (left01.jpg)")
      ->required();
  verb->add_option(
          "--board", a.board,
          "chessboard:9x6:25mm (inner corners, square), or charuco:11x8:30mm:22mm:5X5_100 (squares, square, "
          "marker, dictionary)")
      ->required();
  verb->add_option("--out", a.out, "Folder for rig.json, index.html, transforms.json, opencv/ and colmap/")
      ->required();
  verb->add_option(
      "--world", a.world,
      "Instant whose board is the world: origin at its first corner, x along a row, z out of it [the first "
      "that most cameras see]");
  verb->add_option(
      "--box", a.box,
      "cx,cy,cz,sx,sy,sz: the flame's volume in that world, metres [the largest cube that all cameras see]");
  verb->add_flag("--json", a.json, "One JSON object on stdout");
  verb->callback([arguments] { calibrate_cameras(*arguments); });
}

const char* words_of(DriftVerdict verdict) {
  switch (verdict) {
    case DriftVerdict::still:
      return "still";
    case DriftVerdict::moved:
      return "moved";
    case DriftVerdict::lens:
      return "lens";
    case DriftVerdict::unknown:
      return "unknown";
  }
  return "";
}

nlohmann::json drift_json(const DriftReport& report) {
  nlohmann::json cameras = nlohmann::json::array();
  for (const CameraDrift& camera : report.cameras) {
    cameras.push_back({{"camera", camera.id},
                       {"verdict", words_of(camera.verdict)},
                       {"why", camera.why},
                       {"instants", camera.instants},
                       {"place_mm", {camera.place.x() * 1e3, camera.place.y() * 1e3, camera.place.z() * 1e3}},
                       {"place_sigma_mm", camera.place_sigma * 1e3},
                       {"turn_degrees", camera.turn.norm() * kDegreesOfRadian},
                       {"turn_sigma_degrees", camera.turn_sigma * kDegreesOfRadian},
                       {"chi2", camera.chi2},
                       {"rms_before_pixels", camera.rms_before},
                       {"rms_after_pixels", camera.rms_after}});
  }
  return {{"drifted", report.drifted()},
          {"chi2_limit", report.limit},
          {"rms_before_pixels", report.rms_before},
          {"rms_after_pixels", report.rms_after},
          {"one_of_two", report.one_of_two},
          {"cameras", cameras}};
}

void print_drift(const DriftReport& report) {
  std::printf(
      "%.3f pixels RMS as calibrated, %.3f with the cameras moved that moved; a camera moved if its "
      "chi-square (6 "
      "degrees of freedom) is above %.1f\n",
      report.rms_before, report.rms_after, report.limit);
  for (const CameraDrift& camera : report.cameras) {
    if (camera.verdict == DriftVerdict::unknown || camera.verdict == DriftVerdict::lens) {
      std::printf("%-12s %-8s %s\n", camera.id.c_str(), words_of(camera.verdict), camera.why.c_str());
      continue;
    }
    std::printf("%-12s %-8s %.2f mm (+- %.2f), %.3f degrees (+- %.3f), chi-square %.1f, from %zu instants\n",
                camera.id.c_str(), words_of(camera.verdict), camera.place.norm() * 1e3,
                camera.place_sigma * 1e3, camera.turn.norm() * kDegreesOfRadian,
                camera.turn_sigma * kDegreesOfRadian, camera.chi2, camera.instants);
  }
  if (report.drifted() && report.one_of_two)
    std::printf("Two cameras tell only that they moved against each other, not which of them did.\n");
  std::printf("%s\n", report.drifted()
                          ? "The calibration doesn't hold any more: run `emberlock calibrate cameras` anew."
                          : "The calibration holds.");
}

void add_check(CLI::App& parent) {
  struct Arguments {
    std::string rig;
    std::vector<std::string> pictures;
    std::string board;
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = parent.add_subcommand(
      "check",
      "Whether a camera moved since the calibration, from later pictures of the board; 1 if one did");
  verb->add_option("rig", arguments->rig, "rig.json, or another calibration that `calibrate convert` reads")
      ->required();
  verb->add_option("pictures", arguments->pictures, "As for `calibrate cameras`; a few instants will do")
      ->required();
  verb->add_option("--board", arguments->board, "As for `calibrate cameras`")->required();
  verb->add_flag("--json", arguments->json, "One JSON object on stdout");
  verb->callback([arguments] {
    const v1::Rig rig = or_fail(import_rig(arguments->rig));
    const Progress bar = progress_bar("check");
    const BoardReading reading = read_boards(arguments->pictures, arguments->board, bar, 0.9);
    const DriftReport report_of_drift = or_fail(check_drift(rig, reading.sightings, arguments->rig));
    report(bar, 1, "done");
    if (arguments->json) {
      std::printf("%s\n", drift_json(report_of_drift).dump().c_str());
    } else {
      print_drift(report_of_drift);
    }
    if (report_of_drift.drifted()) throw CLI::RuntimeError(1);
  });
}

void add_convert(CLI::App& parent) {
  struct Arguments {
    std::string rig;
    std::string out;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = parent.add_subcommand(
      "convert", "Another program's calibration as rig.json, and rig.json for other programs");
  verb->add_option("rig", arguments->rig,
                   "rig.json, transforms.json, OpenCV's YAML or XML (a file, or a folder of them), or a "
                   "folder of COLMAP's text")
      ->required();
  verb->add_option("--out", arguments->out, "Folder for rig.json, transforms.json, opencv/ and colmap/")
      ->required();
  verb->callback([arguments] {
    const v1::Rig rig = or_fail(import_rig(arguments->rig));
    AtomicDirectory staging = or_fail(AtomicDirectory::create(arguments->out, kRigMarker));
    or_fail(export_rig(rig, staging.path()));
    or_fail(staging.commit());
    std::printf("%d cameras written to %s\n", rig.cameras_size(), arguments->out.c_str());
  });
}

}  // namespace

void add_calibrate(CLI::App& app) {
  CLI::App* verb = app.add_subcommand(
      "calibrate", "Where the cameras stand, how their lenses draw, and whether that changed");
  verb->require_subcommand(1);
  add_cameras(*verb);
  add_check(*verb);
  add_convert(*verb);
  add_calibrate_colour(*verb);
}

}  // namespace emberlock::cli
