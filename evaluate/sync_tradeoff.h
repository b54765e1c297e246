// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/quantity.h"
#include "base/result.h"
#include "smear_sync/align/align_simulation.h"

namespace emberlock::evaluate {

// What synchrony costs and what it buys: by tolerance, the resets and minutes that each policy takes, and the
// error that it leaves in the reconstruction of a flame that rises.

struct SyncTradeoffOptions {
  std::vector<Rows> tolerances;              ///< ascending; empty: 1 to 200 rows
  std::vector<smear::AlignPolicy> policies;  ///< empty: all of them
  int cameras = 11;                          ///< 2..64
  Hertz frame_rate{23.976};
  SecondsPerRow row_time = microseconds_per_row(54);
  Seconds latency_jitter = milliseconds(0.2);  ///< of one reset on command
  Seconds latency_spread = milliseconds(10);   ///< of the cameras' mean latencies; nothing is told of them
  PartsPerMillion crystal_spread{10};          ///< of the cameras' frame rates
  Seconds reset_time{10};                      ///< of a reset by hand, which fixed-reference and densest take
  Seconds round_time{0.5};
  PartsPerMillion trim_range{100};
  PartsPerMillion trim_step{0.5};
  int rigs = 200;  ///< simulated for a point
  std::uint64_t seed = 1;

  double flame_speed = 2;  ///< m/s, upwards; 0: no flame is looked at
  int voxels = 48;         ///< of the reconstruction, along the volume's edge, 16..128
  int draws = 3;           ///< of the cameras' times within a tolerance
  double added_error = 5;  ///< percent of the error in perfect step that a tolerance may add
  int threads = 0;         ///< 0: every core
};

/// One policy at one tolerance.
struct SyncCost {
  smear::AlignPolicy policy = smear::AlignPolicy::densest;
  Rows tolerance;
  smear::AlignStatistics
      statistics;       ///< no rigs: not simulated, since `expected` resets are more than anybody does
  double expected = 0;  ///< resets, where not simulated
  /// At least 19 rigs of 20 were aligned: mean and percentile mean something.
  [[nodiscard]] bool reached() const {
    return statistics.rigs > 0 && statistics.aligned >= 0.95 * statistics.rigs;
  }
};

/// What one tolerance does to the reconstruction.
struct SyncError {
  Rows tolerance;
  double error = 0;   ///< held-out RMS, grey levels: mean over the draws
  double spread = 0;  ///< standard error of that
};

struct SyncTradeoff {
  SyncTradeoffOptions options;
  std::vector<SyncCost> costs;             ///< by policy, then by tolerance
  std::vector<SyncError> errors;           ///< by tolerance; empty without a flame
  double floor = 0;                        ///< held-out RMS of cameras in perfect step
  std::optional<std::size_t> recommended;  ///< of costs
  std::string why;                         ///< the recommendation, or why there is none, in a sentence
  std::string next_step;                   ///< what more accuracy would cost
  Seconds simulating, reconstructing;
};

/// Errors: bad_input for options out of range; those of the reconstruction. Everything but the times is a
/// pure function of the options.
Result<SyncTradeoff> measure_sync_tradeoff(const SyncTradeoffOptions& options, const Progress& progress = {});

/// The cost at a tolerance that the fewest minutes buy; none where no policy reaches it.
const SyncCost* cheapest(const SyncTradeoff& tradeoff, Rows tolerance);

/// "2.9 s", "20.2 min"
std::string time_text(double seconds);
/// "±10 rows (0.54 ms)"
std::string tolerance_text(const SyncTradeoff& tradeoff, Rows tolerance);

/// The command that measures one point again.
std::string repeat_command(const SyncTradeoff& tradeoff, const SyncCost& cost);

}  // namespace emberlock::evaluate
