// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/result.h"

namespace emberlock::session {

struct SalvagedCamera {
  std::string camera_id;
  std::uint64_t kept = 0;  ///< frames that are on the disk as recorded
  std::uint64_t lost = 0;  ///< known frames whose pixels didn't reach the disk
  std::uint64_t found =
      0;  ///< part of `kept`: frames that were missing in the index and found in the segments
};

struct SalvageReport {
  std::vector<SalvagedCamera> cameras;
  std::uint64_t events_kept = 0;
  bool changed = false;  ///< false: there was nothing to repair
};

/// Repairs a session whose recorder was killed or lost power. It cuts torn ends off the index and the events,
/// adds frames that are only in the segments, keeps the frames that are complete on the disk, and sets the
/// manifest's state to SALVAGED. It reads frames only from the last two segments and from segments that are
/// shorter than the index says. Cameras are processed in parallel on all processors, at this thread's
/// priority. In a finished session only an unreadable index or unreadable events are repaired; the rest is
/// `repair`'s work. If interrupted at any point, by the observer or a crash, it can be continued: a camera's
/// findings are in the manifest before its index is replaced. Errors: bad_input (no session), io, refused (a
/// recorder still writes it, or cancelled by the observer).
Result<SalvageReport> salvage(const std::filesystem::path& folder, const Observer& observer = {});

/// Converts the uncompressed segments of a finished session to FFV1. A segment is replaced only after every
/// frame of the new one has been read back and compared with its hash; a failure leaves the session as
/// readable as before. If interrupted by the observer or a crash, it can be continued. Errors: bad_input, io,
/// refused (cancelled by the observer, or another process writes the session).
Status transcode(const std::filesystem::path& folder, const Observer& observer = {});

}  // namespace emberlock::session
