// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "films/import_strobe.h"
#include "smear_sync/verify/clip_times.h"

namespace emberlock::films {

/// A camera's film on the common clock.
struct TimedFilm {
  std::string id;
  std::string name;  ///< for messages
  smear::ClipTimes times;
  std::int64_t frames = 0;        ///< number of usable frames, from the first on
  std::vector<PlaceRange> lit{};  ///< parts that show the strobe
};

/// The frame of each film for each instant.
struct FramePlan {
  std::size_t reference = 0;  ///< index of the film whose read phases define the instants
  std::vector<std::int64_t>
      instants;  ///< frame numbers of the reference; a gap is an instant that some film lacks
  struct Camera {
    std::vector<std::int64_t> places;  ///< frame index by instant
    std::vector<double> late_s;        ///< read phase minus instant
    std::vector<double> sigma_s;       ///< standard error of late_s; 0 for the reference, by definition
  };
  std::vector<Camera> cameras;
  std::int64_t left_out = 0;  ///< instants in the range that lack a frame of some camera
  std::int64_t repeated = 0;  ///< frames used for two instants (cameras of different rates)
};

struct PlanOptions {
  /// The wanted part of the reference's film; default: the longest part in which no film shows the strobe.
  std::optional<PlaceRange> flame{};
};

/// Cuts the films to their common frames. An instant is a read phase of the reference; each film contributes
/// the frame whose read phase begins closest to it. Frames within two of a flash of the strobe are excluded.
/// Pure. Errors (bad_input, naming the film responsible): no common instant, none without the strobe, or not
/// the whole requested part.
Result<FramePlan> plan_frames(std::span<const TimedFilm> films, std::size_t reference,
                              const PlanOptions& options);

}  // namespace emberlock::films
