// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/reference_front.h"

#include <algorithm>
#include <cmath>

namespace emberlock::recon {
namespace {

struct Row {
  int voxels;
  int iterations;
  const char* effects;
  double seconds;
  double error;
};

#include "recon/pipeline/reference_front.inc"

std::vector<WorkPoint> points_of(const Row* begin, const Row* end) {
  std::vector<WorkPoint> points;
  for (const Row* row = begin; row != end; ++row) {
    points.push_back({{.voxels = row->voxels, .iterations = row->iterations, .effects = row->effects},
                      row->seconds,
                      row->error});
  }
  return points;
}

}  // namespace

int reference_finest() { return kFinest; }

const std::vector<WorkPoint>& reference_front() {
  static const std::vector<WorkPoint> front = points_of(std::begin(kRows), std::end(kRows));
  return front;
}

const std::vector<WorkPoint>& reference_ends() {
  static const std::vector<WorkPoint> ends = points_of(std::begin(kEnds), std::end(kEnds));
  return ends;
}

const std::vector<WorkPoint>& reference_solves() {
  static const std::vector<WorkPoint> solves = points_of(std::begin(kSolves), std::end(kSolves));
  return solves;
}

const std::vector<CalibrationRun>& reference_calibration() {
  static const std::vector<CalibrationRun> runs(std::begin(kCalibration), std::end(kCalibration));
  return runs;
}

std::vector<WorkPoint> scaled(std::vector<WorkPoint> front, int finest, double reference_seconds,
                              double reference_error) {
  for (WorkPoint& p : front) {
    p.settings.voxels =
        std::max(1, static_cast<int>(std::lround(static_cast<double>(p.settings.voxels) * finest / kFinest)));
    p.seconds *= reference_seconds;
    p.error *= reference_error;
  }
  return front;
}

double seconds_at(const std::vector<WorkPoint>& runs, std::string_view effects, int finest, int voxels) {
  std::vector<WorkPoint> kept = scaled(runs, finest, 1, 1);
  std::erase_if(kept, [&](const WorkPoint& p) { return p.settings.effects != effects; });
  return at_voxels(kept, voxels).front().seconds;
}

}  // namespace emberlock::recon
