// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/result.h"
#include "base/sound_track.h"

namespace emberlock::session {

/// The loudness of the sound track of a file's video in steps of a millisecond, counted from the first frame.
/// No levels where there is no sound or none that can be decoded; a damaged track ends at the damage. Errors
/// (bad_input): no readable video.
Result<SoundTrack> read_sound(const std::filesystem::path& path);

}  // namespace emberlock::session
