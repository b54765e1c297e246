// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "smear_sync/ccd_timing.h"
#include "smear_sync/clocks/drift.h"
#include "smear_sync/clocks/frame_code.h"
#include "smear_sync/clocks/read_mode.h"
#include "smear_sync/reading.h"

namespace emberlock::smear {

// A clip is a film of the strobe in a file without reliable times: time stamps in files are nominal or
// jitter, and the clocks of several cameras are unrelated. So the strobe is the clock. The read phase of
// frame i begins tau_i before a flash, modulo the flash period P, and the code of skipped flashes identifies
// the flash. All phases here are modulo P, not the frame period: with a detuned strobe, a phase modulo T
// would jump by P - T once per beat.

/// The readings of one video file.
struct ClipReading {
  std::string file;
  std::string name;                     ///< for display
  int rows = 0;                         ///< n, the picture's height
  std::optional<Hertz> claimed_rate{};  ///< the file's own claim
  std::vector<SmearReading> frames;     ///< by index in the file
};

struct ClipOptions {
  Hertz flash_rate{24.2};                             ///< 1 / P, about one flash per frame
  SecondsPerRow row_time = microseconds_per_row(54);  ///< t_row
  SecondsPerRow row_time_sigma = SecondsPerRow(5e-9);
  Seconds flash_width = microseconds(20);
  std::optional<Hertz> frame_rate{};         ///< 1 / T to within 100 ppm, if the file's claim is wrong
  std::optional<ReadDirection> direction{};  ///< d, if the dots' walk doesn't show it
  std::optional<int> shifts{};               ///< K, if the dots' walk doesn't show it; default: n
  FrameCode code{};                          ///< the flashes that the strobe skips
};

/// One frame with a dot, relative to the fitted line.
struct ClipPoint {
  int frame = 0;     ///< index in the file
  Rows y;            ///< row of the dot
  Seconds tau;       ///< from the dot
  Seconds residual;  ///< tau minus that of the line, wrapped
};

/// A clip's frames on the strobe's clock. Frame i of the file is the camera's frame count_of(i), which
/// includes lost frames.
struct ClipClock {
  CcdTiming timing;      ///< n, K, d and T as measured; t_row as given
  Rows lamp;             ///< y_s, from all frames
  Rows lamp_sigma{};     ///< its standard error, by the detector
  ReadMode mode;         ///< result of the dots' walk, with reasons
  FrameNumbers numbers;  ///< result of the code, with reasons
  std::optional<Drift>
      line;  ///< tau modulo P; frame number c is at time c believed_period; absent: see `reason`
  Seconds believed_period;  ///< T before the measurement
  Seconds flash_period;     ///< P
  Seconds period_sigma;     ///< standard error of timing.frame_period, in seconds of the strobe
  std::vector<ClipPoint> points;
  /// How much larger all taus may be, if K isn't known and the dots used had wrapped. Zero if K is known.
  Seconds tau_slack{};
  int lit = 0;                              ///< number of frames that show the lamp
  std::vector<FlashSeen> seen;              ///< by frame: whether the strobe lit it
  PhaseState state = PhaseState::unusable;  ///< known if there is a line and d is known
  std::string reason;                       ///< one sentence if it isn't known

  /// The camera's frame count at index `i` of the file, starting at that of index 0.
  [[nodiscard]] std::int64_t count_of(std::int64_t i) const;
  /// tau of the read phase of frame `i`, modulo P. Requires a line.
  [[nodiscard]] Phase phase_of_frame(std::int64_t i) const;
  /// Whether d is known, from the dots' walk or from `options`.
  [[nodiscard]] bool direction_known(const ClipOptions& options) const {
    return mode.direction.has_value() || options.direction.has_value();
  }
  /// The run of numbered frames that contains index `i`, or the nearest; nullptr if there is none.
  [[nodiscard]] const NumberedRun* run_at(std::int64_t i) const;
};

/// The result of the walk of a clip's dots, and the frame rate with which it fits: the file's claim, or a
/// usual rate that is often rounded to it.
struct ClipWalk {
  Hertz frame_rate;
  ReadMode mode;
};

/// d and K of the camera, from a clip under one flash per frame or under a comb (options.flash_rate). A walk
/// that needs a frame rate more than 120 ppm off is rejected. Errors: those of find_read_mode.
Result<ClipWalk> read_walk(const ClipReading& clip, const ClipOptions& options);

/// Puts a clip on the strobe's clock: the lamp's place from all frames; d, K and T from the dots' walk; lost
/// frames and flash numbers from the code; tau from the line through all dots. Errors (bad_input): options
/// that aren't positive and finite.
Result<ClipClock> read_clip_clock(const ClipReading& clip, const ClipOptions& options);

}  // namespace emberlock::smear
