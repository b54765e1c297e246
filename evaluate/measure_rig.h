// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/image.h"
#include "base/progress.h"
#include "base/quantity.h"
#include "base/result.h"
#include "evaluate/rig_tradeoff.h"
#include "recon/compute/device.h"
#include "smear_sync/align/align.h"

namespace emberlock::evaluate {

/// Lists are the axes.
struct RigTradeoffOptions {
  double flame_speed = 2;   ///< m/s, upwards, 0..100
  Meters flame_size{0.16};  ///< height; the cameras stand as much farther away as it is larger
  std::vector<int> cameras{4, 6, 8, 12, 16};                          ///< ascending, 3..32
  std::vector<ImageSize> images{{160, 120}, {320, 240}, {640, 480}};  ///< ascending, 32..2048 wide
  std::vector<int> voxels{24, 32, 48, 64, 96};                        ///< ascending, 8..192
  std::vector<std::string> effects{"none", "auto"};                   ///< as parse_effects() takes them
  std::vector<Seconds> exposures{milliseconds(1), milliseconds(4), milliseconds(16)};
  std::vector<Seconds> tolerances{milliseconds(0.2), milliseconds(0.5), milliseconds(2), milliseconds(5)};
  std::vector<recon::Device> devices;                                   ///< none: all that this machine has
  std::vector<smear::AlignPolicy> policies{smear::AlignPolicy::timed};  ///< the quickest of them counts
  Seconds reset_time{10};    ///< of a reset by hand (policies fixed-reference and densest)
  double camera_price = 60;  ///< euros
  double noise = 1;          ///< of a pixel exposed for 4 ms, grey levels; falls with the root of the light
  int frames = 240;          ///< to reconstruct: ten seconds
  std::optional<double> target;  ///< error, grey levels; none: a quarter above the lowest
  int rigs = 50;                 ///< simulated for each number of cameras and tolerance
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0: all cores
};

/// A joint set-up that was simulated, and what had been predicted for it.
struct RigCheck {
  RigSetup setup;
  RigFrame predicted, simulated;
};

struct RigTradeoff {
  RigTradeoffOptions options;  ///< with devices and target filled in
  RigGrid grid;
  RigFrames frames;  ///< all that was simulated
  std::vector<RigCheck> checks;
  std::vector<RigPoint> points;
  std::vector<std::size_t> front;
  std::optional<std::size_t> chosen;  ///< the cheapest simulated one that meets the target
  std::size_t best = 0;               ///< the simulated one of least error
  std::vector<RigStep> steps;         ///< from `chosen`, or else from `best`
  Seconds took{0};
};

/// Simulates alignments and flames along each axis, joins, then simulates what is chosen, its neighbours and
/// some of the front, and chooses again until the choice is a simulated one. Errors: bad_input for options
/// out of range, a device that isn't usable, a tolerance that no policy reaches; those of reconstruct().
Result<RigTradeoff> measure_rig_tradeoff(const RigTradeoffOptions& options, const Clock& clock,
                                         const Progress& progress = {});

/// "12 cameras", "320x240", "within 0.5 ms"
std::string choice_text(const RigTradeoffOptions& options, RigAxis axis, std::size_t choice);
/// All of a set-up's choices, separated by commas; of the device only where there are several.
std::string setup_text(const RigTradeoffOptions& options, const RigSetup& setup);

}  // namespace emberlock::evaluate
