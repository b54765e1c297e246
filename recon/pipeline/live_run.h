// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "recon/pipeline/frame_sequence.h"
#include "recon/pipeline/live_frames.h"
#include "recon/pipeline/session_scene.h"
#include "session/reader.h"

namespace emberlock::recon {

struct LiveOptions {
  std::uint64_t every = 0;         ///< as LivePace::every
  std::optional<int> voxels = {};  ///< along the longest edge; else as many as the machine holds
  ComputeOptions compute;
  std::function<bool()> stop = {};  ///< true: the volume at hand isn't wanted any more
};

/// What came of a frame.
struct LiveVolume {
  std::size_t frame = 0;      ///< the first camera's
  TimePoint filmed;           ///< its arrival
  Seconds took{0};            ///< from the disk to the volume
  std::uint64_t skipped = 0;  ///< as NewestFrames::skipped()
  int voxels = 0;
  Seconds typical{0};  ///< that volumes of so many voxels take, lately
  LiveVerdict verdict;
  Result<Volume> volume;  ///< or why there is none: most often no flame is seen
};

/// A volume for the newest frame of a recording, again and again while it grows. So that one is as quick as
/// the next it has a fixed number of passes, glows without absorbing (no search for effects), trusts the
/// calibration, and begins with the volume before (FrameSequence); the dark picture of each camera and the
/// box, where the session has none, are those of the first frame that became a volume. The recording can be
/// reconstructed in full later.
class LiveRun {
 public:
  /// Passes over the pictures: beginning with the volume before, further ones hardly change it.
  static constexpr int kPasses = 6;

  /// `reader` follows the recording. The clock must outlive it.
  LiveRun(session::SessionReader reader, LiveOptions options, const Clock& clock);

  /// So many frames of each camera are on the disk: of them the newest, if there is a newer one than the
  /// last. Errors: those of SessionReader::advance().
  Result<std::optional<LiveVolume>> step(const std::vector<std::uint64_t>& safe);

 private:
  Result<Volume> reconstruct(std::size_t frame);
  [[nodiscard]] int voxels() const;

  session::SessionReader reader_;
  LiveOptions options_;
  const Clock& clock_;
  LivePace pace_;
  NewestFrames frames_;
  VolumeTimes times_;
  std::optional<LiveVoxels> choice_;  ///< from the first scene on, where nobody told the voxels
  SceneOptions scene_;
  KeptDevelopers developers_;
  std::optional<FrameSequence> sequence_;
};

}  // namespace emberlock::recon
