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

// Cost and benefit of synchronization: for each tolerance, the resets and minutes that each policy needs, and
// the error that the tolerance causes in the reconstruction of a rising flame.

struct SyncTradeoffOptions {
  std::vector<Rows> tolerances;              ///< ascending; default: 1 to 200 rows
  std::vector<smear::AlignPolicy> policies;  ///< default: all
  int cameras = 11;                          ///< 2..64
  Hertz frame_rate{23.976};
  SecondsPerRow row_time = microseconds_per_row(54);
  Seconds latency_jitter = milliseconds(0.2);  ///< of a single reset on command
  Seconds latency_spread =
      milliseconds(10);  ///< spread of the cameras' mean latencies, which the policy doesn't know
  PartsPerMillion crystal_spread{10};  ///< of the cameras' frame rates
  Seconds reset_time{10};              ///< duration of a reset by hand (policies fixed-reference and densest)
  Seconds round_time{0.5};
  PartsPerMillion trim_range{100};
  PartsPerMillion trim_step{0.5};
  int rigs = 200;  ///< number of simulated rigs per point
  std::uint64_t seed = 1;

  double flame_speed = 2;  ///< m/s, upwards; 0: no flame is simulated
  int voxels = 48;         ///< of the reconstruction, along the longest edge, 16..128
  int draws = 3;           ///< of the cameras' times within a tolerance
  double added_error = 5;  ///< per cent of the error with perfect synchronization that a tolerance may add
  int threads = 0;         ///< 0: all cores
};

/// One policy at one tolerance.
struct SyncCost {
  smear::AlignPolicy policy = smear::AlignPolicy::densest;
  Rows tolerance;
  smear::AlignStatistics
      statistics;       ///< empty: not simulated, because `expected` resets are too many in practice
  double expected = 0;  ///< number of resets, if not simulated
  /// At least 19 of 20 rigs were aligned, so mean and percentile are meaningful.
  [[nodiscard]] bool reached() const {
    return statistics.rigs > 0 && statistics.aligned >= 0.95 * statistics.rigs;
  }
};

/// The effect of a tolerance on the reconstruction.
struct SyncError {
  Rows tolerance;
  double error = 0;   ///< held-out RMS error, grey levels: mean over the draws
  double spread = 0;  ///< standard error of the mean
};

struct SyncTradeoff {
  SyncTradeoffOptions options;
  std::vector<SyncCost> costs;             ///< by policy, then by tolerance
  std::vector<SyncError> errors;           ///< by tolerance; empty without a flame
  double floor = 0;                        ///< held-out RMS error with perfect synchronization
  std::optional<std::size_t> recommended;  ///< index of `costs`
  std::string why;                         ///< one sentence: the recommendation, or why there is none
  std::string next_step;                   ///< what more accuracy would cost
  Seconds simulating, reconstructing;
};

/// Errors: bad_input for options out of range; those of the reconstruction. All results except the times are
/// a pure function of the options.
Result<SyncTradeoff> measure_sync_tradeoff(const SyncTradeoffOptions& options, const Progress& progress = {});

/// The policy that reaches a tolerance in the fewest minutes; null if none reaches it.
const SyncCost* cheapest(const SyncTradeoff& tradeoff, Rows tolerance);

/// "2.9 s", "20.2 min"
std::string time_text(double seconds);
/// "±10 rows (0.54 ms)"
std::string tolerance_text(const SyncTradeoff& tradeoff, Rows tolerance);

/// The command that repeats the measurement of one point.
std::string repeat_command(const SyncTradeoff& tradeoff, const SyncCost& cost);

}  // namespace emberlock::evaluate
