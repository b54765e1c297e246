// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/result.h"
#include "base/sound_track.h"

namespace emberlock::session {

/// How loud the sound track that goes with a file's video is, millisecond by millisecond, counted from its
/// first frame. Empty levels where it has none, or none that can be decoded; a track that is damaged ends
/// there. Errors (bad_input): no readable video.
Result<SoundTrack> read_sound(const std::filesystem::path& path);

}  // namespace emberlock::session
