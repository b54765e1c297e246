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
  int flame_frames = 12;   ///< recorded of each camera, 1..60
  int voxels = 128;        ///< along the volume's edge
  int truth_voxels = 128;  ///< of the flame that is filmed
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0: every core
};

/// The last frame of every camera in one round of an alignment, with what was read and where its dot had to
/// lie.
struct SmearSnapshot {
  struct Camera {
    std::string id;
    Frame frame;
    smear::SmearReading reading;
    smear::Phase phase;
    std::optional<Rows> error;  ///< to the target
  };
  std::vector<Camera> cameras;
  std::optional<Seconds> target_tau;
};

/// One alignment from its first round to its last.
struct AlignStage {
  std::string title = {};
  smear::AlignPolicy policy = smear::AlignPolicy::densest;
  Rows tolerance = {};
  std::vector<std::vector<std::optional<Rows>>> errors = {};  ///< [round][camera], to the round's target
  SmearSnapshot first = {};  ///< the first round in which a target stood: nothing had been reset by then
  SmearSnapshot last = {};
  AlignRunResult result = {};
  Seconds seconds = {};  ///< by the wall clock
};

/// Everything that the demonstration measured, beside what the rig knows to be true.
struct DemoResult {
  DemoOptions options;
  std::vector<smear::RowClock> row_clocks;  ///< by camera
  std::vector<SecondsPerRow> true_row_times;
  std::vector<AlignStage> stages;  ///< within 100 rows by hand, then within 10 rows by timed resets
  Seconds true_worst_pair;         ///< largest difference of two cameras' read starts after the last stage
  v1::Manifest flame_session;
  int held_out = 0;
  recon::Scene scene;
  recon::Outcome outcome;                 ///< default solver
  recon::Outcome paper;                   ///< the paper's, on the same pictures
  Seconds record_seconds, total_seconds;  ///< by the wall clock
};

/// Makes the progress of a step from the step's title.
using ProgressFactory = std::function<Progress(const std::string&)>;

/// Films, aligns, records and reconstructs with simulated cameras; sessions and the reconstruction are left
/// in `folder` (flame/, alignment/, reconstruction/). Errors: bad_input for options out of range, and those
/// of the stages.
Result<DemoResult> run_demo(const DemoOptions& options, const std::filesystem::path& folder,
                            const ProgressFactory& progress);

}  // namespace emberlock::rig
