// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/progress.h"
#include "drivers/camera.h"

// Tests whether a camera is suitable: films for some seconds and assesses the frames.
namespace emberlock::drivers {

struct ProbeOptions {
  Seconds film{5};  ///< duration of filming, >= 0.5
  int resets = 0;   ///< number of shutter resets to time afterwards, >= 0
};

/// What a camera delivered during the probe.
struct ProbeFilm {
  CameraInfo info;
  std::vector<FrameStamp> stamps;  ///< in the order of arrival
  FrameCounts counts;              ///< from the first frame on
  std::vector<Seconds>
      reset_delays;  ///< from each reset command to the arrival of the first frame with the new phase
  std::optional<Error> failed = {};  ///< the error that ended it early
};

/// Films. Errors: those of a camera that doesn't start or sends nothing. A later failure is part of the
/// result.
Result<ProbeFilm> film_probe(Camera& camera, const ProbeOptions& options, Clock& clock,
                             const Progress& progress);

enum class Fitness {
  good,
  poor,  ///< usable; follow the remedy
  unfit,
};
std::string_view name(Fitness fitness);

struct ProbeFinding {
  std::string what;  ///< "rate", "frames", ...
  Fitness fitness = Fitness::good;
  std::string measured;     ///< as text, with units
  std::string remedy = {};  ///< if the fitness isn't good
};

/// A mean and its standard deviation.
struct Spread {
  Seconds mean;
  Seconds sigma;
};

struct ProbeVerdict {
  Hertz rate;                          ///< by the camera's clock if its stamps are defined, else by arrival
  Seconds arrival_jitter;              ///< RMS deviation of arrivals from an even rate
  Seconds arrival_worst;               ///< largest deviation, early or late
  std::optional<double> megabits;      ///< needed bandwidth of an uncompressed link, Mbit/s
  std::optional<Spread> reset = {};    ///< of the reset delays; absent with fewer than two
  std::vector<ProbeFinding> findings;  ///< rate, frames, arrival, bandwidth, and reset if it was timed
  Fitness fitness = Fitness::good;     ///< the worst of the findings
};

/// Pure. `link_megabits` is the bandwidth of the camera's bus or network in Mbit/s, if known.
ProbeVerdict assess(const ProbeFilm& film, std::optional<double> link_megabits);

}  // namespace emberlock::drivers
