// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "base/result.h"
#include "daemon/work/jobs.h"
#include "rig/config/config.h"
#include "session/store.h"

namespace emberlock::daemon {

// What sessions need that nobody asks for: salvage and compression, as jobs in the background. Each may be
// cut short anywhere; the next one goes on from there.

/// Error `refused` while a session is salvaged, or waits for it: nothing else may be done to it.
Status check_not_salvaged(const Jobs& jobs, const std::string& session);

/// Whether a session holds uncompressed segments.
bool is_uncompressed(const std::filesystem::path& session);

/// Told what came of a session's job, on the job's thread.
struct UpkeepTold {
  std::function<void(const std::string& session, const JobResult&)> salvaged = {};
  std::function<void(const std::string& session, const JobResult&)> compressed = {};
};

/// Adds the salvage of a session whose recorder was killed, and its compression after that where it is wanted
/// and needed. `jobs` outlives what it adds.
void salvage_later(const std::filesystem::path& session, Jobs& jobs,
                   rig::RecordingConfig::Transcode transcode, const UpkeepTold& told);
/// Adds the compression of a session that is uncompressed: its segments become FFV1, every frame of which is
/// read back before the uncompressed one goes.
void compress_later(const std::filesystem::path& session, Jobs& jobs, const UpkeepTold& told);

/// Adds what an earlier daemon left: first what it didn't finish, then, where that is wanted, what is
/// uncompressed. A session that was salvaged is compressed too. Returns at once; `store` and `jobs` outlive
/// what it adds.
void take_up(const session::SessionStore& store, Jobs& jobs, rig::RecordingConfig::Transcode transcode,
             const UpkeepTold& told);

}  // namespace emberlock::daemon
