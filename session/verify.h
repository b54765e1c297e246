// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "emberlock/v1/session.pb.h"

namespace emberlock::session {

/// What lies on disk of one camera's recording. recorded + what the index has too much = good + bad +
/// missing.
struct CameraCheck {
  std::string camera_id;
  std::uint64_t recorded = 0;   ///< as the manifest counts; of a recording that isn't finished, the index
  std::uint64_t good = 0;       ///< come back with the pixels that were recorded
  std::uint64_t bad = 0;        ///< in the index, but can't be read back
  std::uint64_t missing = 0;    ///< counted, but not in the index
  std::uint64_t unindexed = 0;  ///< good, but not in the index: repair takes them up
  std::vector<std::string> problems;  ///< "FILE: what", each once
};

struct SessionCheck {
  v1::Manifest::State state = v1::Manifest::STATE_UNSPECIFIED;
  std::vector<CameraCheck> cameras;
  std::uint64_t events = 0;
  std::vector<std::string> problems;  ///< of no one camera
  std::string to_do;                  ///< a sentence; empty where nothing is

  /// Finished, and all there: of each camera at least one frame, and each that was recorded.
  [[nodiscard]] bool whole() const;
};

/// Reads everything back: every frame is decoded and compared with its hash, index, events, segments and
/// counts with each other; frames that lie in segments and not in the index are found. Changes nothing.
/// Errors: bad_input (no session, or a manifest that can't be read), refused (ended by the observer).
Result<SessionCheck> verify_session(const std::filesystem::path& folder, const Observer& observer = {});

struct RepairedCamera {
  std::string camera_id;
  std::uint64_t kept = 0;
  std::uint64_t lost = 0;              ///< frames that were in the recording before
  std::uint64_t found = 0;             ///< of those kept: which the index lacked, and the segments told of
  std::vector<std::string> rewritten;  ///< segments, relative to the session's folder
};

struct RepairReport {
  std::vector<RepairedCamera> cameras;
  std::uint64_t events_kept = 0;
  bool changed = false;  ///< false: it was whole
};

/// Makes a session whole: salvages it where its recorder was killed, else keeps what `verify_session` calls
/// good, takes up what only the segments tell of, and takes the rest out. Of a segment with bad frames the
/// good ones are written anew and read back before they replace it; a segment without any stays on disk,
/// outside the session. What was lost is counted as the disk's. It can be ended at any time, and taken up
/// again. Errors: as verify_session, io, refused (another process writes it).
Result<RepairReport> repair_session(const std::filesystem::path& folder, const Observer& observer = {});

}  // namespace emberlock::session
