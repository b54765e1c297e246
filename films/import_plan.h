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

/// A camera's film on the clock that all share.
struct TimedFilm {
  std::string id;
  std::string name;  ///< for messages
  smear::ClipTimes times;
  std::int64_t frames = 0;        ///< usable: it ends before this place
  std::vector<PlaceRange> lit{};  ///< parts that show the strobe
};

/// Which frame of each film belongs to which instant.
struct FramePlan {
  std::size_t reference = 0;           ///< its read phases are the instants
  std::vector<std::int64_t> instants;  ///< the reference's counts; a gap is an instant that a film lacks
  struct Camera {
    std::vector<std::int64_t> places;  ///< by instant
    std::vector<double> late_s;        ///< read phase less instant
    std::vector<double> sigma_s;  ///< standard error of late_s; 0 of the reference, which makes the instants
  };
  std::vector<Camera> cameras;
  std::int64_t left_out = 0;  ///< instants within that lack a frame of some camera
  std::int64_t repeated = 0;  ///< frames that belong to two instants: cameras of different rates
};

struct PlanOptions {
  /// Part of the reference's film that is wanted; else the longest in which no film shows the strobe.
  std::optional<PlaceRange> flame{};
};

/// Cuts the films to their common frames: an instant is a read phase of the reference, and has of each film
/// the frame whose read phase begins nearest. Frames within two of a strobe's flash are no flame. Pure.
/// Errors (bad_input): films that have no instant in common, or none without the strobe, or not all of the
/// part that was asked for, with the film that is to blame.
Result<FramePlan> plan_frames(std::span<const TimedFilm> films, std::size_t reference,
                              const PlanOptions& options);

}  // namespace emberlock::films
