// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/image.h"
#include "base/progress.h"
#include "base/result.h"
#include "base/sound_track.h"
#include "smear_sync/reading.h"
#include "smear_sync/verify/clip_clock.h"

namespace emberlock::films {

/// The lamp's columns of one frame, kept for display.
struct ClipStrip {
  int frame = 0;                ///< index of the frame in the file
  Image pixels;                 ///< full height
  smear::SmearReading reading;  ///< in the strip's coordinates
};

/// The readings of a clip, and a few of its frames at even intervals.
struct FilmedClip {
  smear::ClipReading reading;
  SoundTrack sound{};
  std::vector<ClipStrip> strips;
};

/// Decodes the files and reads every frame, one thread per clip. Memory grows with the number of frames only
/// by their readings. Errors: one message with the errors of all unreadable files.
Result<std::vector<FilmedClip>> read_clips(const std::vector<std::string>& files, const Progress& progress);

}  // namespace emberlock::films
