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

/// The lamp's columns of one frame, kept to be shown.
struct ClipStrip {
  int frame = 0;                ///< place in the file
  Image pixels;                 ///< full height
  smear::SmearReading reading;  ///< in the strip's own columns
};

/// A clip as read, and a few of its frames, evenly spread.
struct FilmedClip {
  smear::ClipReading reading;
  SoundTrack sound{};
  std::vector<ClipStrip> strips;
};

/// Decodes the files and reads every frame, one clip a thread; what is kept of a clip doesn't grow with its
/// frames but for their readings. Errors: those of all files that can't be read, in one message.
Result<std::vector<FilmedClip>> read_clips(const std::vector<std::string>& files, const Progress& progress);

}  // namespace emberlock::films
