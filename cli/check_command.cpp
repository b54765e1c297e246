// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/board_options.h"
#include "cli/commands.h"
#include "cli/rig_argument.h"
#include "films/board_search.h"
#include "recon/calibrate/drift.h"

namespace emberlock::cli {
namespace {

constexpr double kDegreesOfTurn = 180 / M_PI;
constexpr std::size_t kCheckInstants = 20;  // a check needs fewer than a calibration

const char* words_of(recon::DriftVerdict verdict) {
  switch (verdict) {
    case recon::DriftVerdict::still:
      return "still";
    case recon::DriftVerdict::moved:
      return "moved";
    case recon::DriftVerdict::lens:
      return "lens";
    case recon::DriftVerdict::unknown:
      return "unknown";
  }
  return "";
}

nlohmann::json drift_json(const recon::DriftReport& report) {
  nlohmann::json cameras = nlohmann::json::array();
  for (const recon::CameraDrift& camera : report.cameras) {
    cameras.push_back({{"camera", camera.id},
                       {"verdict", words_of(camera.verdict)},
                       {"why", camera.why},
                       {"instants", camera.instants},
                       {"place_mm", {camera.place.x() * 1e3, camera.place.y() * 1e3, camera.place.z() * 1e3}},
                       {"place_sigma_mm", camera.place_sigma * 1e3},
                       {"turn_degrees", camera.turn.norm() * kDegreesOfTurn},
                       {"turn_sigma_degrees", camera.turn_sigma * kDegreesOfTurn},
                       {"turn_alone", camera.turn_alone},
                       {"chi2", camera.chi2},
                       {"freedom", camera.freedom},
                       {"chi2_limit", camera.limit},
                       {"rms_before_pixels", camera.rms_before},
                       {"rms_after_pixels", camera.rms_after}});
  }
  return {{"drifted", report.drifted()},
          {"rms_before_pixels", report.rms_before},
          {"rms_after_pixels", report.rms_after},
          {"one_of_two", report.one_of_two},
          {"cameras", cameras}};
}

void print_camera(const recon::CameraDrift& camera) {
  if (camera.verdict == recon::DriftVerdict::unknown || camera.verdict == recon::DriftVerdict::lens) {
    std::printf("%-12s %-8s %s\n", camera.id.c_str(), words_of(camera.verdict), camera.why.c_str());
    return;
  }
  const std::string place =
      camera.turn_alone
          ? std::string("place not told")
          : fmt::format("{:.2f} mm (+- {:.2f})", camera.place.norm() * 1e3, camera.place_sigma * 1e3);
  std::printf(
      "%-12s %-8s %s, %.3f degrees (+- %.3f), chi-square %.1f of %d (moved above %.1f), from %zu instants\n",
      camera.id.c_str(), words_of(camera.verdict), place.c_str(), camera.turn.norm() * kDegreesOfTurn,
      camera.turn_sigma * kDegreesOfTurn, camera.chi2, camera.freedom, camera.limit, camera.instants);
}

void print_drift(const recon::DriftReport& report) {
  std::printf("%.3f pixels RMS as calibrated, %.3f with the cameras moved that moved\n", report.rms_before,
              report.rms_after);
  for (const recon::CameraDrift& camera : report.cameras) print_camera(camera);
  if (std::any_of(report.cameras.begin(), report.cameras.end(),
                  [](const recon::CameraDrift& camera) { return camera.turn_alone; }))
    std::printf(
        "The lamp was at too few places to tell where a camera stands: only turns are told, and what one "
        "place can't show counts as none. Show it at three places or more, not in one line.\n");
  if (report.drifted() && report.one_of_two)
    std::printf("Two cameras tell only that they moved against each other, not which of them did.\n");
  std::printf("%s\n", report.drifted()
                          ? "The calibration doesn't hold any more: run `emberlock calibrate cameras` anew."
                          : "The calibration holds.");
}

struct CheckArguments {
  std::string rig;
  films::BoardArguments boards;
  bool lamp = false;
  bool json = false;
};

void check(const CheckArguments& arguments) {
  const v1::Rig rig = or_fail(import_rig_argument(arguments.rig));
  const recon::BoardSearch search =
      arguments.lamp ? films::search_for_lamp()
                     : recon::search_for(or_fail(recon::parse_board(arguments.boards.board)));
  const Progress bar = progress_bar("check");
  const recon::BoardReading reading =
      or_fail(films::read_boards(arguments.boards, search, [&](double fraction, std::string_view what) {
        tell(bar, 0.9 * fraction, what);
      }));
  const recon::DriftReport drift = or_fail(recon::check_drift(rig, reading.sightings, arguments.rig));
  tell(bar, 1, "done");
  if (arguments.json) {
    std::printf("%s\n", drift_json(drift).dump().c_str());
  } else {
    if (reading.film) std::printf("%s\n", films::film_words(reading).c_str());
    print_drift(drift);
  }
  if (drift.drifted()) throw Exit(1);
}

}  // namespace

void add_calibrate_check(const Verb& parent) {
  auto arguments = std::make_shared<CheckArguments>();
  const Verb verb = parent.add_verb("check",
                                    "Whether a camera moved since the calibration, from later pictures "
                                    "of the board or a lamp; exit code 1 if one did");
  verb.add_option("rig", arguments->rig, "rig.json, or another calibration that `calibrate convert` reads")
      .require();
  add_board_options(verb, arguments->boards, kCheckInstants);
  const Option lamp =
      verb.add_flag("--lamp", arguments->lamp,
                    "The pictures show one small bright lamp, such as the strobe's, at a new place at each "
                    "instant. Three places show all movements, one or two only rotations");
  verb.find_option("--board").exclude(lamp);
  verb.add_flag("--json", arguments->json, "One JSON object on stdout");
  verb.set_action([arguments] {
    if (!arguments->lamp && arguments->boards.board.empty())
      throw UsageError("--board or --lamp is required");
    check(*arguments);
  });
}

}  // namespace emberlock::cli
