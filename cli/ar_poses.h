// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apply/marker.h"
#include "apply/pose_track.h"
#include "base/result.h"
#include "cli/ar_film.h"

namespace emberlock::cli {

/// Where the marker is in each frame of a film.
struct ArPoses {
  std::vector<apply::TrackedPose> frames;

  [[nodiscard]] std::size_t count(apply::TrackedPose::From from) const;
  /// Root of the mean square of the frames' own, over those in which the marker is seen, pixels.
  [[nodiscard]] double rms() const;
};

/// Looks through the whole film. Errors: those of ArFilm::next(); bad_input where the marker is in none of
/// its frames: the error says which markers there are instead, as far as the first frames show any.
Result<ArPoses> find_poses(ArFilm& film, const apply::Marker& marker, const recon::Intrinsics& lens,
                           const std::array<float, 256>& light);

/// poses.json: how it was filmed, and of each frame its time, where the pose is from, its residual and the
/// pose. `path` is written in place: call it inside an OutputFolder.
Status write_poses(const std::filesystem::path& path, const ArFilm& film, const apply::Marker& marker,
                   const recon::Intrinsics& lens, const ArPoses& poses);

}  // namespace emberlock::cli
