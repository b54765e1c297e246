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

// Movies on a camera's card. These functions never write to the card or delete from it, except start_movie().
namespace emberlock::drivers {

struct Clip {
  std::uint32_t handle = 0;  ///< valid until the camera is unplugged
  std::string name;          ///< "MVI_0001.AVI"
  std::uint32_t bytes = 0;
  std::string captured;  ///< as the camera reports it, "20261121T225747"; may be empty
};

/// Starts recording a movie onto the card, in record mode; returns once it records. Error: also when a movie
/// is already being recorded.
Status start_movie(Chdk& chdk, Clock& clock, Seconds deadline = Seconds(3));
/// Stops the movie; returns once it is saved. No effect when none is recorded.
Status stop_movie(Chdk& chdk, Clock& clock, Seconds deadline = Seconds(30));

/// The movies on the card, sorted by name. Those of 4 GiB or more, which PTP can't address, are skipped with
/// a warning. Many cameras list their card only in playback mode (Chdk::change_mode).
Result<std::vector<Clip>> list_clips(PtpSession& session);

/// Downloads a clip to `target`, creating its folder if needed, and writes `target`.sha256 beside it for
/// `sha256sum -c`. While incomplete, the file is `target`.part. A repeated call after an interruption
/// continues it, if its last bytes match the camera's; otherwise, or if the camera can't send parts, it
/// starts again. The written file is read back and compared before it is renamed. Errors: the session's; io;
/// bad_input when `target` exists.
Status download_clip(PtpSession& session, const Clip& clip, const std::filesystem::path& target,
                     const Progress& progress = {});

/// Checks a downloaded clip against `target`.sha256. Errors: io; bad_input when it differs.
Status verify_clip(const std::filesystem::path& target);

}  // namespace emberlock::drivers
