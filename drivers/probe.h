// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/progress.h"
#include "drivers/camera.h"

// Whether a camera is fit for its work: filmed for some seconds, and judged by what came.
namespace emberlock::drivers {

struct ProbeOptions {
  Seconds film{5};  ///< how long, >= 0.5
  int resets = 0;   ///< resets of the shutter to time afterwards, >= 0
};

/// What came of a camera.
struct ProbeFilm {
  CameraInfo info;
  std::vector<FrameStamp> stamps;     ///< in the order of coming
  FrameCounts counts;                 ///< from the first of them on
  std::vector<Seconds> reset_delays;  ///< from each order to the arrival of the first frame of the new phase
  std::optional<Error> failed = {};   ///< what ended it early
};

/// Films. Errors: the camera's that it doesn't start, or sends nothing. What fails later is part of the film.
Result<ProbeFilm> film_probe(Camera& camera, const ProbeOptions& options, Clock& clock,
                             const Progress& progress);

enum class Fitness {
  good,
  poor,  ///< usable, with the remedy in mind
  unfit,
};
std::string_view name(Fitness fitness);

struct ProbeFinding {
  std::string what;  ///< "rate", "frames", ...
  Fitness fitness = Fitness::good;
  std::string measured;     ///< in words, with units
  std::string remedy = {};  ///< where it isn't good
};

/// A value and its standard deviation about it.
struct Spread {
  Seconds mean;
  Seconds sigma;
};

struct ProbeVerdict {
  Hertz rate;              ///< by the camera's own clock where its stamps say what they mark, else by arrival
  Seconds arrival_jitter;  ///< RMS of arrivals about an even rate
  Seconds arrival_worst;   ///< the latest or earliest
  std::optional<double> megabits;      ///< a second, as sent by an uncompressed link
  std::optional<Spread> reset = {};    ///< of the delays; absent with fewer than two
  std::vector<ProbeFinding> findings;  ///< rate, frames, arrival, bandwidth, and reset where it was timed
  Fitness fitness = Fitness::good;     ///< the worst of them
};

/// Pure. `link_megabits` is what the camera's bus or network carries a second, where that is known.
ProbeVerdict judge(const ProbeFilm& film, std::optional<double> link_megabits);

}  // namespace emberlock::drivers
