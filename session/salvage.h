#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/result.h"

namespace emberlock {

struct SalvagedCamera {
  std::string camera_id;
  std::uint64_t kept = 0;  ///< frames that decode to the pixels recorded
  std::uint64_t lost = 0;  ///< frames in the index whose pixels didn't reach the disk
};

struct SalvageReport {
  std::vector<SalvagedCamera> cameras;
  std::uint64_t events_kept = 0;
  bool changed = false;  ///< false: there was nothing to mend
};

/// Repairs a session whose recorder was killed: cuts torn ends off the index and the events, keeps the frames
/// that decode, and turns the manifest SALVAGED. Of a finished session only an index or events that can't be
/// read are mended; `repair` does the rest. Errors: bad_input (no session), io, refused (a recorder still
/// writes it).
Result<SalvageReport> salvage(const std::filesystem::path& folder, const Progress& progress = {});

/// Turns the uncompressed segments of a finished session into FFV1. Each is replaced only after every frame
/// of its successor has been read back and matched with its hash; a failure leaves the session as readable as
/// before. One that was cut short, by the observer or a crash, is taken up again. Errors: bad_input, io,
/// refused (ended by the observer, or another process writes the session).
Status transcode(const std::filesystem::path& folder, const Observer& observer = {});

}  // namespace emberlock
