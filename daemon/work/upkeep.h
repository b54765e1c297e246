// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "base/result.h"
#include "daemon/work/work_queue.h"
#include "rig/config/config.h"
#include "session/salvage.h"
#include "session/store.h"

namespace emberlock::daemon {

// What sessions need that nobody waits for, as work for a queue. Each piece may be cut short anywhere and is
// taken up again where it is added anew.

/// Salvages a session whose recorder was killed.
Work salvage_of(const std::filesystem::path& session,
                std::function<void(const Result<session::SalvageReport>&)> done = {});

/// Error `refused` while a session is salvaged, or waits for it: nothing else may be done to it.
Status check_not_salvaged(const WorkQueue& queue, const std::string& session);

/// Turns a session's uncompressed segments into FFV1, every frame of which is read back before the
/// uncompressed one goes. `done` isn't told where there was nothing to compress.
Work compression_of(const std::filesystem::path& session, std::function<void(const Status&)> done = {});

/// Whether a session holds uncompressed segments.
bool is_uncompressed(const std::filesystem::path& session);

/// Told of a session, on the queue's thread.
struct UpkeepTold {
  std::function<void(const std::string& session, const Result<session::SalvageReport>&)> salvaged = {};
  std::function<void(const std::string& session, const Status&)> compressed = {};
};

/// Adds the salvage of a session, and its compression after that where it is wanted and needed. `queue`
/// outlives what it adds.
void salvage_later(const std::filesystem::path& session, WorkQueue& queue,
                   rig::RecordingConfig::Transcode transcode, const UpkeepTold& told);
/// Adds the compression of a session that is uncompressed.
void compress_later(const std::filesystem::path& session, WorkQueue& queue, const UpkeepTold& told);

/// Adds what an earlier daemon left: first what it didn't finish, then, where that is wanted, what is
/// uncompressed. A session that was salvaged is compressed too. Returns at once; `store` and `queue` outlive
/// what it adds.
void take_up(const session::SessionStore& store, WorkQueue& queue, rig::RecordingConfig::Transcode transcode,
             const UpkeepTold& told);

}  // namespace emberlock::daemon
