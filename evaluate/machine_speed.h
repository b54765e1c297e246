// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>

#include "base/clock.h"
#include "base/image.h"
#include "base/progress.h"
#include "base/result.h"
#include "recon/compute/device.h"

namespace emberlock::evaluate {

/// A rig as it is planned.
struct PlannedRig {
  int cameras = 10;
  ImageSize size{640, 480};
  double rate = 24;            ///< frames a second
  double bytes_per_pixel = 1;  ///< as recorded: 1 for 8 bits of one channel or of a Bayer pattern
  int voxels = 128;            ///< along the longest edge
  friend bool operator==(const PlannedRig&, const PlannedRig&) = default;
};
/// Errors (bad_input) name the option of `emberlock bench`.
Status check(const PlannedRig& rig);

/// What one frame's reconstruction takes, from pictures in memory to the views rendered.
struct FrameTimes {
  Seconds told{0};   ///< constant extinction, told
  Seconds found{0};  ///< the effects found out from the pictures
};

/// Reconstructs a drawn flame as such a rig would film it. Of `repeats` runs the quickest counts. Errors:
/// those of recon::reconstruct().
Result<FrameTimes> time_frame(const PlannedRig& rig, const recon::ComputeOptions& compute, int repeats,
                              const Clock& clock, const Progress& progress = {});

/// What is compared between machines.
struct MachineSpeed {
  double disk = 0;  ///< bytes a second that the recordings' disk takes
  FrameTimes cpu;   ///< of PlannedRig{}
  std::optional<FrameTimes> cuda;
};
/// The machines of README.md, by the command that stands there.
MachineSpeed readme_machine();
std::string_view readme_machine_name();

/// What a machine makes of a rig.
struct RigExpectation {
  double bytes_per_s = 0;         ///< that the rig sends
  int cameras_recorded = 0;       ///< that the disk takes, with half as much to spare
  bool recorded = false;          ///< whether it takes this rig's
  double seconds_per_second = 0;  ///< of reconstruction for one of film, every frame
};
/// Errors: bad_input for the rig; not_converged for speeds that aren't finite and positive.
Result<RigExpectation> expectation(const PlannedRig& rig, double disk, const FrameTimes& frame);

}  // namespace emberlock::evaluate
