// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "smear_sync/align/align.h"
#include "smear_sync/align/align_words.h"

namespace emberlock::smear {

/// Cameras and strobe as bare numbers on one time axis: what align_step is judged against, without pictures,
/// and what tolerances cost is measured with.
struct AlignSimulation {
  int cameras = 11;
  AlignOptions options;
  bool delay_known = false;  ///< whether align_step is told the mean delay of the model
  ShutterReset method = ShutterReset::on_command;
  Seconds latency_jitter = milliseconds(0.2);
  Seconds latency_spread{0};           ///< of the cameras' mean latencies
  Seconds latency_bias{0};             ///< by which the delay told is wrong
  PartsPerMillion rate_spread{0};      ///< of the cameras' rates
  PartsPerMillion period_offset{167};  ///< strobe period against the cameras', as 23.972 Hz against 23.976
  PartsPerMillion period_offset_error{2};  ///< error of the offset that the policy is told
  double noise_rows = 0.3;                 ///< of a round's phase
  double flash_rows = 0;       ///< the flash's width where whole-row shifts are simulated; 0: they aren't
  double bloom_rows = 25;      ///< phases this near to the lamp show no dot
  double visible_rows = 720;   ///< nor does the rest after these
  double round_seconds = 0.6;  ///< of filming one round
  double reset_seconds = 0;    ///< of one reset more in a round
  std::optional<FrameRateTrim> trim;  ///< of every camera
  double spread_rows = 0;             ///< the cameras start within so many rows to either side; 0: anywhere
  double hold_seconds = 0;            ///< once aligned: go on, checking when the policy asks for it
};

struct AlignOutcome {
  AlignDecision decision;  ///< the last, or the one that found the cameras aligned
  AlignWords words;        ///< of that
  AlignState state;
  int resets = 0;
  int rounds = 0;
  double seconds = 0;          ///< until the verdict
  double true_worst_rows = 0;  ///< largest true difference to the target, at the verdict
  // Of the time held:
  double held_worst_rows = 0;  ///< largest true difference to the target of the check before, at any check
  int checks = 0;              ///< that the policy asked for two rounds ahead or more
  int late_checks = 0;         ///< that found a camera out of tolerance in truth
};

/// One rig drawn by the seed, aligned. Deterministic.
AlignOutcome simulate(const AlignSimulation& simulation, std::uint64_t seed);

/// Of many rigs.
struct AlignStatistics {
  int rigs = 0;
  int aligned = 0;
  double resets = 0;  ///< mean
  int resets_p95 = 0;
  double seconds = 0;  ///< mean
  double seconds_p95 = 0;
  double seconds_worst = 0;
  double rounds = 0;           ///< mean
  double true_worst_rows = 0;  ///< of those aligned
};
AlignStatistics summarise(const std::vector<AlignOutcome>& outcomes);

/// Seeds first_seed, first_seed + 1, ...
AlignStatistics simulate_many(const AlignSimulation& simulation, int rigs, std::uint64_t first_seed = 0);

}  // namespace emberlock::smear
