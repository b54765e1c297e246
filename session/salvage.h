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
  std::uint64_t kept = 0;   ///< frames that lie on the disk as they were recorded
  std::uint64_t lost = 0;   ///< frames that are known of, but whose pixels didn't reach the disk
  std::uint64_t found = 0;  ///< of those kept: which the index lacked, and the segments told of
};

struct SalvageReport {
  std::vector<SalvagedCamera> cameras;
  std::uint64_t events_kept = 0;
  bool changed = false;  ///< false: there was nothing to mend
};

/// Repairs a session whose recorder was killed, or that a power cut ended: cuts torn ends off the index and
/// the events, takes up the frames of which only the segments tell, keeps those that lie whole on the disk,
/// and turns the manifest SALVAGED. Frames are read of the last two segments alone, and of those that are
/// shorter than the index says; cameras are read on as many threads as there are processors, at this thread's
/// priority. Of a finished session only an index or events that can't be read are mended; `repair` does the
/// rest. Cut short at any point, by the observer or a crash, it leaves a session that salvage takes up again:
/// what it found of a camera stands in the manifest before that camera's index is replaced. Errors: bad_input
/// (no session), io, refused (a recorder still writes it, or ended by the observer).
Result<SalvageReport> salvage(const std::filesystem::path& folder, const Observer& observer = {});

/// Turns the uncompressed segments of a finished session into FFV1. Each is replaced only after every frame
/// of its successor has been read back and matched with its hash; a failure leaves the session as readable as
/// before. One that was cut short, by the observer or a crash, is taken up again. Errors: bad_input, io,
/// refused (ended by the observer, or another process writes the session).
Status transcode(const std::filesystem::path& folder, const Observer& observer = {});

}  // namespace emberlock::session
