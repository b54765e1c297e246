// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "recon/pipeline/reconstruct.h"
#include "rig/align/run.h"
#include "rig/devices/stage.h"

namespace emberlock::rig {

struct DemoOptions {
  int cameras = 11;  ///< 3..64; one of them is held out
  ImageSize image{1280, 720};
  int flame_frames = 12;   ///< recorded per camera, 1..60
  int voxels = 128;        ///< along the volume's longest edge
  int truth_voxels = 128;  ///< of the filmed flame
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0: all cores
};

/// The last frame of every camera in a round of an alignment, with its reading and the required position of
/// its dot.
struct SmearSnapshot {
  struct Camera {
    std::string id;
    Frame frame;
    smear::SmearReading reading;
    smear::Phase phase;
    std::optional<Rows> error;  ///< relative to the target
  };
  std::vector<Camera> cameras;
  std::optional<Seconds> target_tau;
};

/// An alignment from first to last round.
struct AlignStage {
  std::string title = {};
  smear::AlignPolicy policy = smear::AlignPolicy::densest;
  Rows tolerance = {};
  std::vector<std::vector<std::optional<Rows>>> errors =
      {};                    ///< [round][camera], relative to the round's target
  SmearSnapshot first = {};  ///< the first round with a target, before any reset
  SmearSnapshot last = {};
  AlignRunResult result = {};
  Seconds seconds = {};  ///< wall clock time
};

/// All measurements of the demonstration, and the rig's true values.
struct DemoResult {
  DemoOptions options;
  std::vector<smear::RowClock> row_clocks;  ///< by camera
  std::vector<SecondsPerRow> true_row_times;
  std::vector<AlignStage> stages;  ///< within 100 rows by hand, then within 10 rows by timed resets
  Seconds true_worst_pair;  ///< largest difference of two cameras' starts of read-out after the last stage
  v1::Manifest flame_session;
  int held_out = 0;
  recon::Scene scene;
  recon::Outcome outcome;                 ///< of the default solver
  recon::Outcome paper;                   ///< of the paper's solver, on the same pictures
  Seconds record_seconds, total_seconds;  ///< wall clock time
  /// False where it was stopped: then `kept` names what lies in the folder, a line each, and the rest is
  /// empty.
  bool whole = false;
  std::vector<std::string> kept;
};

/// Creates the progress of a step from its title.
using ProgressFactory = std::function<Progress(const std::string&)>;

/// Films, aligns, records and reconstructs with simulated cameras. Leaves sessions and reconstruction in
/// `folder` (flame/, alignment/, reconstruction/). `stop` is asked while it aligns and films and between the
/// reconstructions: what is begun is finished so that it can be read. Errors: bad_input for options out of
/// range, and those of the stages.
Result<DemoResult> run_demo(const DemoOptions& options, const std::filesystem::path& folder,
                            const ProgressFactory& progress, const StopAsked& stop = {});

}  // namespace emberlock::rig
