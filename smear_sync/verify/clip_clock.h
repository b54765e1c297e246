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

// A clip is a film of the strobe whose file says nothing of when its frames were taken: timestamps of files
// are nominal or jitter, and the clocks of several cameras have nothing in common. The strobe is the clock
// instead: frame i begins to be read at tau_i before a flash, modulo the flashes' period P, and the code of
// skipped flashes says which flash that was. All phases here go around modulo P, not the frame period: a
// detuned strobe puts its dot off by P - T once a beat.

/// What was read off one video file.
struct ClipReading {
  std::string file;
  std::string name;                     ///< what people call it
  int rows = 0;                         ///< n, the picture's height
  std::optional<Hertz> claimed_rate{};  ///< by the file
  std::vector<SmearReading> frames;     ///< by place in the file
};

struct ClipOptions {
  Hertz flash_rate{24.2};                             ///< 1 / P, about one flash a frame
  SecondsPerRow row_time = microseconds_per_row(54);  ///< t_row
  SecondsPerRow row_time_sigma = SecondsPerRow(5e-9);
  Seconds flash_width = microseconds(20);
  std::optional<Hertz> frame_rate{};         ///< 1 / T to within 100 ppm, where the file's claim is wrong
  std::optional<ReadDirection> direction{};  ///< d, where the dots' walk doesn't tell it
  std::optional<int> shifts{};               ///< K, where the dots' walk doesn't tell it; else n
  FrameCode code{};                          ///< what the strobe skips
};

/// One frame with a dot, against the line.
struct ClipPoint {
  int frame = 0;     ///< place in the file
  Rows y;            ///< the dot's
  Seconds tau;       ///< as the dot says
  Seconds residual;  ///< tau less the line's, to the nearest side
};

/// A clip's frames on the strobe's time. Frame i of the file is the camera's frame count_of(i): frames that
/// were lost on the way are counted.
struct ClipClock {
  CcdTiming timing;      ///< n, K, d and T as measured; t_row as given
  Rows lamp;             ///< y_s, over all frames
  Rows lamp_sigma{};     ///< its error, as the detector states it
  ReadMode mode;         ///< what the walk of the dots told, and why it didn't
  FrameNumbers numbers;  ///< what the code told, and why it didn't
  std::optional<Drift>
      line;  ///< tau modulo P, where frame number c is at c believed_period; absent: see `reason`
  Seconds believed_period;  ///< T before it was measured
  Seconds flash_period;     ///< P
  Seconds period_sigma;     ///< standard error of timing.frame_period, in the strobe's seconds
  std::vector<ClipPoint> points;
  /// How much more all taus may be: K isn't known, and the dots that tell them had wrapped. Zero where it is.
  Seconds tau_slack{};
  int lit = 0;                              ///< frames that show the lamp
  std::vector<FlashSeen> seen;              ///< by place: whether the strobe lit it
  PhaseState state = PhaseState::unusable;  ///< known when there is a line and d is known
  std::string reason;                       ///< one sentence when it isn't

  /// Where the camera's count stands at place `i` of the file: a count of frames from that of place 0.
  [[nodiscard]] std::int64_t count_of(std::int64_t i) const;
  /// tau of the read phase of place `i`, modulo P. There must be a line.
  [[nodiscard]] Phase phase_of_frame(std::int64_t i) const;
  /// Whether d was told, by the dots' walk or by `options`.
  [[nodiscard]] bool direction_known(const ClipOptions& options) const {
    return mode.direction.has_value() || options.direction.has_value();
  }
  /// The run of numbered frames that holds place `i`, or the nearest; nullptr when there is none.
  [[nodiscard]] const NumberedRun* run_at(std::int64_t i) const;
};

/// What the walk of a clip's dots tells, and the frame rate under which it does: the file's claim, or one in
/// use that is often rounded to it.
struct ClipWalk {
  Hertz frame_rate;
  ReadMode mode;
};

/// d and K of the camera, of a clip under one flash a frame or under a comb (options.flash_rate). A walk that
/// wants a frame rate more than 120 ppm off tells nothing. Errors: those of find_read_mode.
Result<ClipWalk> read_walk(const ClipReading& clip, const ClipOptions& options);

/// Puts a clip on the strobe's time: the lamp's place from all frames; d, K and T from the dots' walk; lost
/// frames and flash numbers from the code; tau from the line through all dots. Errors (bad_input): options
/// that aren't positive and finite.
Result<ClipClock> read_clip_clock(const ClipReading& clip, const ClipOptions& options);

}  // namespace emberlock::smear
