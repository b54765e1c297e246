// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "drivers/ptp/chdk.h"
#include "drivers/ptp/session.h"

// Movies on a camera's card. Nothing here writes to the card or deletes from it.
namespace emberlock::drivers {

struct Clip {
  std::uint32_t handle = 0;  ///< until the camera is unplugged
  std::string name;          ///< "MVI_0001.AVI"
  std::uint32_t bytes = 0;
  std::string captured;  ///< as the camera says it, "20261121T225747"; may be empty
};

/// Starts a movie onto the card, in record mode; returns once it runs. Error: also when one does already.
Status start_movie(Chdk& chdk, Clock& clock, Seconds deadline = Seconds(3));
/// Ends it; returns once it is saved. Harmless when none runs.
Status stop_movie(Chdk& chdk, Clock& clock, Seconds deadline = Seconds(30));

/// What movies there are, by name; those of 4 GiB or more, which PTP can't address, are left out with a
/// warning. Many cameras list their card in playback mode only (Chdk::change_mode).
Result<std::vector<Clip>> list_clips(PtpSession& session);

/// Downloads a clip to `target`, whose folder it makes if need be, and beside it `target`.sha256 as
/// `sha256sum -c` reads it. Until it is whole it grows as `target`.part: called again after an interruption
/// it goes on from there, once the last of what is there was found to be what the camera has; else, and with
/// a camera that can't send parts, it starts anew. What was written is read back and compared before the file
/// gets its name. Errors: the session's; io; bad_input when `target` is there already.
Status download_clip(PtpSession& session, const Clip& clip, const std::filesystem::path& target,
                     const Progress& progress = {});

/// Whether a downloaded clip still is what `target`.sha256 says. Errors: io; bad_input when it isn't.
Status verify_clip(const std::filesystem::path& target);

}  // namespace emberlock::drivers
