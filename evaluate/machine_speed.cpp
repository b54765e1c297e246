// SPDX-License-Identifier: Apache-2.0
#include "evaluate/machine_speed.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "recon/pipeline/reconstruct.h"
#include "recon/synthetic/flame.h"

namespace emberlock::evaluate {
namespace {

constexpr double kToSpare = 1.5;  // a disk has slow moments
constexpr double kMostCameras = 1e6;

Status check_range(double value, double low, double high, const char* what, const char* option) {
  if (value >= low && value <= high) return {};
  return Error{ErrorKind::bad_input, fmt::format("{} out of range: {:g}", what, value), option,
               fmt::format("Give {:g}..{:g}", low, high)};
}

bool is_time(Seconds seconds) { return std::isfinite(seconds.value()) && seconds > Seconds(0); }

}  // namespace

Status check(const PlannedRig& rig) {
  EMBERLOCK_RETURN_IF_ERROR(check_range(rig.cameras, 2, 1000, "number of cameras", "--cameras"));
  EMBERLOCK_RETURN_IF_ERROR(check_range(rig.size.width, 16, 8192, "width", "--size"));
  EMBERLOCK_RETURN_IF_ERROR(check_range(rig.size.height, 16, 8192, "height", "--size"));
  EMBERLOCK_RETURN_IF_ERROR(check_range(rig.rate, 0.01, 100000, "frame rate", "--fps"));
  EMBERLOCK_RETURN_IF_ERROR(check_range(rig.bytes_per_pixel, 1, 8, "bytes a pixel", "--bytes-per-pixel"));
  return check_range(rig.voxels, 8, 512, "number of voxels", "--voxels");
}

Result<FrameTimes> time_frame(const PlannedRig& rig, const recon::ComputeOptions& compute, int repeats,
                              const Clock& clock, const Progress& progress) {
  EMBERLOCK_RETURN_IF_ERROR(check(rig));
  recon::PaperSceneOptions film;
  film.image = rig.size;
  film.cameras = rig.cameras;
  recon::Scene scene = recon::paper_scene(film);
  scene.views.pop_back();  // the held-out one: a rig has none to spare
  FrameTimes times;
  int done = 0;
  const auto run = [&](const std::string& effects, Seconds& quickest) -> Status {
    recon::ReconstructOptions options;
    options.voxels = rig.voxels;
    options.solve.compute = compute;
    EMBERLOCK_ASSIGN_OR_RETURN(options.effects, recon::parse_effects(effects));
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Outcome outcome, recon::reconstruct(scene, options, clock));
    const Seconds taken = outcome.report.total_time;
    if (quickest == Seconds(0) || taken < quickest) quickest = taken;
    tell(progress, ++done / (2.0 * repeats), "a frame");
    return {};
  };
  for (int n = 0; n < repeats; ++n) {
    EMBERLOCK_RETURN_IF_ERROR(run(fmt::format("extinction={}", film.flame.extinction.value()), times.told));
    EMBERLOCK_RETURN_IF_ERROR(run("auto", times.found));
  }
  return times;
}

MachineSpeed readme_machine() {
  return {
      .disk = 270e6, .cpu = {Seconds(0.71), Seconds(2.2)}, .cuda = FrameTimes{Seconds(0.13), Seconds(0.28)}};
}
std::string_view readme_machine_name() { return "2 cores of a virtual machine; GPU: one H100 with 16 cores"; }

Result<RigExpectation> expectation(const PlannedRig& rig, double disk, const FrameTimes& frame) {
  EMBERLOCK_RETURN_IF_ERROR(check(rig));
  if (!std::isfinite(disk) || !(disk > 0) || !is_time(frame.told) || !is_time(frame.found))
    return Error{ErrorKind::not_converged,
                 fmt::format("this machine was measured as {:g} bytes/s, {:g} s and {:g} s a frame", disk,
                             frame.told.value(), frame.found.value()),
                 "bench", "Run it again when the machine does nothing else"};
  const double of_one = rig.bytes_per_pixel * rig.size.width * rig.size.height * rig.rate;
  RigExpectation expected;
  expected.bytes_per_s = of_one * rig.cameras;
  expected.cameras_recorded =
      static_cast<int>(std::min(kMostCameras, std::floor(disk / (kToSpare * of_one))));
  expected.recorded = expected.cameras_recorded >= rig.cameras;
  expected.seconds_per_second = frame.found.value() * rig.rate;
  return expected;
}

}  // namespace emberlock::evaluate
