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

/// State of one camera's recording on disk. recorded + surplus records of the index = good + bad + missing.
struct CameraCheck {
  std::string camera_id;
  std::uint64_t recorded = 0;         ///< by the manifest; in an unfinished recording, by the index
  std::uint64_t good = 0;             ///< are read back with the recorded pixels
  std::uint64_t bad = 0;              ///< in the index, but unreadable
  std::uint64_t missing = 0;          ///< counted, but not in the index
  std::uint64_t unindexed = 0;        ///< good, but not in the index: `repair` adds them
  std::vector<std::string> problems;  ///< "FILE: what", without duplicates
};

struct SessionCheck {
  v1::Manifest::State state = v1::Manifest::STATE_UNSPECIFIED;
  std::vector<CameraCheck> cameras;
  std::uint64_t events = 0;
  std::vector<std::string> problems;  ///< those that belong to no single camera
  std::string to_do;                  ///< one sentence; empty if there is nothing to do
  std::uint64_t certified_files = 0;  ///< that certificate.json tells of and that are as it says; 0: without
  std::string certified_by;           ///< the public key that signed it; empty: none did
  bool readable = false;              ///< it is whole, but for what certificate.json may say

  /// Finished and complete: every camera has at least one frame and all recorded frames.
  [[nodiscard]] bool whole() const;
};

/// Reads everything back: decodes every frame and compares it with its hash; compares index, events, segments
/// and counts with each other; finds frames that are in segments but not in the index; compares every file
/// with certificate.json, where there is one. Changes nothing. Errors: bad_input (no session, or an
/// unreadable manifest), refused (cancelled by the observer).
Result<SessionCheck> verify_session(const std::filesystem::path& folder, const Observer& observer = {});

struct RepairedCamera {
  std::string camera_id;
  std::uint64_t kept = 0;
  std::uint64_t lost = 0;  ///< frames that were in the recording before
  std::uint64_t found =
      0;  ///< part of the kept frames: they were missing in the index and found in the segments
  std::vector<std::string> rewritten;  ///< segments, relative to the session's folder
};

struct RepairReport {
  std::vector<RepairedCamera> cameras;
  std::uint64_t events_kept = 0;
  bool changed = false;  ///< false: there was nothing to repair
};

/// Repairs a session. It salvages a session whose recorder was killed. Then it keeps the frames that
/// `verify_session` calls good, adds those that are only in the segments, and removes the rest. The good
/// frames of a segment with bad ones are written to a new file, which is read back before it replaces the
/// segment; a segment without good frames stays on disk, outside the session. Lost frames are counted under
/// the cause `disk`. It can be interrupted at any time and continued. Errors: as verify_session, io, refused
/// (another process writes the session).
Result<RepairReport> repair_session(const std::filesystem::path& folder, const Observer& observer = {});

}  // namespace emberlock::session
