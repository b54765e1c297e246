// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/progress.h"
#include "base/result.h"
#include "evaluate/error_law.h"
#include "recon/views/view.h"

namespace emberlock::evaluate {

// The twin of a rig: the paper's arrangement, lenses of 60 degrees at 1.9 heights of the flame, whatever the
// flame's size and the rig's lenses.

/// The edge of a pixel at the flame, in its heights, of pictures so many pixels wide.
double twin_pixel(int width);
/// Of the box around the flame: an edge for two pixels, but 8 at least and 192 at most.
int twin_voxels(int width);
/// A pixel's edge as far as the voxels resolve it.
double resolved(double pixel);

/// A drawn flame, filmed and reconstructed by any cameras; the effects are found from the pictures, as
/// `reconstruct` does. The cameras of judge_directions() judge every rig alike: in time, sharp, without
/// noise.
class Twin {
 public:
  explicit Twin(std::uint64_t seed, int threads = 0) : seed_(seed), threads_(threads) {}
  /// RMS of the judges' held-out errors, grey levels. Errors: those of recon::reconstruct().
  Result<double> measure(const TwinRig& rig, const Clock& clock);

 private:
  std::uint64_t seed_;
  int threads_;
  std::vector<recon::View> judges_;
};

struct NamedRig {
  std::string name;
  TwinRig rig;
};
/// Small rigs that differ in one part each, and two that do in several: what a law is fitted to.
std::vector<NamedRig> sweep_rigs();
/// Five others, of which each differs in several: what a law is checked by.
std::vector<NamedRig> check_rigs();

/// What of a rig lies beyond all of those two lists, which a law was fitted to and checked by: "3 cameras
/// (simulated: 4 to 16)". Empty: nothing, and the law's uncertainty() holds.
std::vector<std::string> list_extrapolated(const TwinRig& rig);

/// Every rig by twin. Errors: those of Twin::measure().
Result<std::vector<MeasuredRig>> measure_all(Twin& twin, const std::vector<NamedRig>& rigs,
                                             const Clock& clock, const Progress& progress = {});

}  // namespace emberlock::evaluate
