// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "base/frame.h"
#include "base/progress.h"
#include "base/result.h"
#include "drivers/camera.h"
#include "drivers/strobe.h"
#include "session/async_writer.h"
#include "smear_sync/align/align.h"
#include "smear_sync/align/align_words.h"
#include "smear_sync/ccd_timing.h"
#include "smear_sync/clocks/row_clock.h"
#include "smear_sync/detect/detect.h"

namespace emberlock::rig {

/// What an alignment acts on. Cameras go by their index everywhere.
struct AlignRig {
  std::vector<drivers::Camera*> cameras;
  drivers::Strobe* strobe = nullptr;
  Clock* clock = nullptr;
  /// Takes every frame, strobe setting, reset, trim and decision, if there is one.
  session::AsyncWriter* recorder = nullptr;
};

struct AlignRunOptions {
  /// period, row_time, rows: of the rig's cameras; the run sets period, round_time and sweep_time to the
  /// cameras' own and, once measured, row_time.
  smear::AlignOptions align;
  /// By camera: n, K and d must be right (a wrong d reverses every correction); row_time is used where it
  /// isn't measured. Of global shutters n and t_row say nothing.
  std::vector<smear::CcdTiming> timing;
  /// By camera, or empty: what is known of the resets' delay from an earlier run.
  std::vector<std::optional<smear::ResetDelay>> delays;
  /// By camera, or empty: AlignCamera::offset, from stagger().
  std::vector<Seconds> offsets;
  bool measure_row_time = true;    ///< of CCDs from a comb, before the first round
  std::optional<Hertz> comb_rate;  ///< flashes a second; if absent about ten a frame
  int comb_frames = 24;            ///< of each camera
  int frames_per_round = 4;        ///< of each camera, > 0
  Seconds flash_width = microseconds(20);
  Seconds frame_deadline{3};              ///< longest wait for a frame, a reset's latency included
  Seconds reset_lead = milliseconds(20);  ///< between ordering a reset and its earliest moment
  PartsPerMillion rate_error{20};         ///< standard error of the cameras' common rate against the strobe's
  std::uint64_t seed = 1;                 ///< of the moments of resets that aren't timed
  /// Once aligned: goes on for so long, filming again by each next check and resetting what left.
  std::optional<Seconds> hold{};
};
/// Of `hold`: until it is stopped.
constexpr Seconds kUntilStopped{3e9};

/// One round, as an observer sees it. References are good for the length of the call.
struct AlignRoundReport {
  const smear::AlignRound& round;
  const smear::AlignDecision& decision;
  const smear::AlignWords& words;  ///< the sentences of that
  const std::vector<smear::AlignCamera>& cameras;
  const std::vector<SensorKind>& sensors;  ///< by camera
  const smear::AlignOptions& options;
  const drivers::StrobeSettings& strobe;
  const std::vector<std::vector<Frame>>& frames;                  ///< [camera][frame]
  const std::vector<std::vector<smear::SmearReading>>& readings;  ///< of those
};
using AlignObserver = std::function<void(const AlignRoundReport&)>;

struct AlignRunResult {
  smear::AlignDecision last;
  smear::AlignWords words;  ///< of that
  std::vector<drivers::CameraInfo> cameras;
  smear::AlignOptions options;                             ///< with period and row_time as used
  std::vector<smear::CcdTiming> timing;                    ///< with the row times measured
  std::vector<std::optional<smear::RowClock>> row_clocks;  ///< by camera, where one was measured
  std::vector<std::optional<Seconds>> exposures;           ///< by camera, where flashes tell
  std::vector<std::optional<smear::ResetDelay>>
      delays;  ///< by camera, what is known now: options for the next run
  std::vector<Seconds>
      offsets;  ///< of staggered cameras, by camera: from one target to each one's own instant
  int resets = 0;
  int checks = 0;  ///< while it was held
};

/// Asked between rounds and while nothing is to be done: true ends the run.
using StopAsked = std::function<bool()>;

/// Films the strobe, measures t_row of CCDs from a comb and sweeps the strobe's phase for cameras of other
/// sensors (smear_sync/sensors/phase_sensor.h), then films, decides and resets until the cameras are aligned
/// or align_step gives up. Starts the cameras and leaves them filming. The decisions are align_step's; all
/// that is taken from the clock are instants that are recorded with what they were taken for, so a recording
/// replays to the same bits through this function. Errors: bad_input (frame rates that differ, sizes of the
/// lists), and the devices'.
Result<AlignRunResult> run_align(const AlignRig& rig, const AlignRunOptions& options,
                                 const AlignObserver& observer = {}, const Progress& progress = {},
                                 const StopAsked& stop = {});

}  // namespace emberlock::rig
