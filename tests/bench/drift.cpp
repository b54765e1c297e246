// SPDX-License-Identifier: Apache-2.0
// drift [SEEDS] [CAMERAS] [INSTANTS] [LATER] [PLACES]: rigs of cameras on a ring are calibrated from INSTANTS
// views of a board and then checked by LATER others, and by a lamp at PLACES places: how often a rig that
// stood still is said to have moved, how chi-square is spread then, and from what turn on a camera is named.
#include "recon/calibrate/drift.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "tests/support/board_rig.h"

namespace {
using namespace emberlock;

constexpr int kKnocked = 2;

struct Tally {
  int checks = 0;
  int alarms = 0;                      ///< that aren't the knocked camera's
  int named = 0;                       ///< the knocked one
  std::vector<double> share_of_limit;  ///< chi-square over its limit, still cameras
  double chi2 = 0;
  int freedom = 0;
};

void count(const v1::Rig& file, const recon::BoardSightings& later, bool knocked, Tally& tally) {
  const auto report = recon::check_drift(file, later, "rig.json");
  if (!report) {
    std::printf("FAILED: %s\n", report.error().message().c_str());
    return;
  }
  ++tally.checks;
  bool alarm = false;
  for (std::size_t c = 0; c < report->cameras.size(); ++c) {
    const recon::CameraDrift& camera = report->cameras[c];
    const bool moved =
        camera.verdict == recon::DriftVerdict::moved || camera.verdict == recon::DriftVerdict::lens;
    if (knocked && c == kKnocked) {
      tally.named += moved ? 1 : 0;
    } else {
      alarm = alarm || moved;
      tally.chi2 += camera.chi2;
      tally.freedom += camera.freedom;
      if (camera.limit > 0) tally.share_of_limit.push_back(camera.chi2 / camera.limit);
    }
  }
  tally.alarms += alarm ? 1 : 0;
}

void tell(const char* what, Tally tally) {
  std::sort(tally.share_of_limit.begin(), tally.share_of_limit.end());
  const double most = tally.share_of_limit.empty() ? 0 : tally.share_of_limit.back();
  std::printf(
      "%-28s %4d checks  %3d false alarms  %4d named  mean chi2 %.2f of its freedom  most %.2f of the "
      "limit\n",
      what, tally.checks, tally.alarms, tally.named, tally.chi2 / std::max(1, tally.freedom), most);
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int i, int usual) { return argc > i ? std::atoi(argv[i]) : usual; };
  const int seeds = number(1, 200);
  test::BoardRigOptions options;
  options.cameras = number(2, 5);
  const int instants = number(3, 40);
  const int later = number(4, 12);
  const int places = number(5, 5);
  options.instants = instants + later;
  options.board = {recon::BoardKind::chessboard, 9, 6, Meters(0.022)};
  const std::vector<double> turns = {0, 0.02, 0.05, 0.1, 0.2};
  std::vector<Tally> boards(turns.size());
  std::vector<Tally> lamps(turns.size());
  for (int seed = 1; seed <= seeds; ++seed) {
    options.seed = static_cast<std::uint64_t>(seed);
    const test::BoardRig rig = test::board_rig(options);
    recon::BoardSightings before = rig.sightings;
    std::erase_if(before.sightings, [&](const auto& s) { return static_cast<int>(s.instant) >= instants; });
    recon::BoardSightings after = rig.sightings;
    std::erase_if(after.sightings, [&](const auto& s) { return static_cast<int>(s.instant) < instants; });
    const auto found = recon::calibrate_rig(before, {.world = "0"});
    if (!found || !found->whole()) {
      std::printf("%d isn't calibrated\n", seed);
      continue;
    }
    const recon::BoardSightings lamp =
        test::lamp_sightings(rig, test::lamp_places(rig, places, options.seed), options.noise, options.seed);
    test::BoardRig believed = rig;
    for (std::size_t i = 0; i < found->bundle.cameras.size(); ++i)
      believed.cameras[found->bundle_camera[i]] = found->bundle.cameras[i].model;
    for (std::size_t t = 0; t < turns.size(); ++t) {
      v1::Rig file = recon::rig_of(*found, "");
      if (turns[t] > 0) test::knock(file, believed, kKnocked, {.turn = {0, turns[t] * M_PI / 180, 0}});
      count(file, after, turns[t] > 0, boards[t]);
      count(file, lamp, turns[t] > 0, lamps[t]);
    }
  }
  std::printf("%d cameras, calibrated from %d instants, checked by %d and by a lamp at %d places\n",
              options.cameras, instants, later, places);
  for (std::size_t t = 0; t < turns.size(); ++t) {
    char what[64];
    std::snprintf(what, sizeof(what), "board, turned by %.2f deg", turns[t]);
    tell(what, boards[t]);
    std::snprintf(what, sizeof(what), "lamp, turned by %.2f deg", turns[t]);
    tell(what, lamps[t]);
  }
  return 0;
}
