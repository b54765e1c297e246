// SPDX-License-Identifier: Apache-2.0
#include "daemon/work/upkeep.h"

#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "session/job_messages.h"
#include "session/salvage.h"

namespace emberlock::daemon {
namespace fs = std::filesystem;

bool is_uncompressed(const fs::path& session) {
  std::error_code ec;
  for (fs::recursive_directory_iterator at(session, ec), end; !ec && at != end; at.increment(ec)) {
    if (at->path().extension() == ".nut") return true;
  }
  return false;
}

Status check_not_salvaged(const Jobs& jobs, const std::string& session) {
  const auto job = jobs.find(v1::Job::SALVAGE, session);
  if (!job) return {};
  const bool begun = job->fraction() > 0;
  return Error{ErrorKind::refused,
               begun ? fmt::format("it is being salvaged, {:.0f} % are done", 100 * job->fraction())
                     : "it waits to be salvaged",
               "session " + session,
               job->state() == v1::Job::PAUSED
                   ? "Salvage stands still while something is recorded: ask again after that"
                   : "Ask again when that is done; `emberlock status` shows how far it is"};
}

void compress_later(const fs::path& session, Jobs& jobs, const UpkeepTold& told) {
  if (!is_uncompressed(session)) return;
  Job job{v1::Job::COMPRESS, session.filename().string(), [session](const Observer& observer) -> JobResult {
            EMBERLOCK_RETURN_IF_ERROR(session::transcode(session, observer));
            v1::JobOutcome outcome;
            outcome.set_ok(true);
            return outcome;
          }};
  job.ended = [told, name = job.session](const JobResult& result) {
    if (told.compressed) told.compressed(name, result);
  };
  static_cast<void>(jobs.add(std::move(job)));
}

void salvage_later(const fs::path& session, Jobs& jobs, rig::RecordingConfig::Transcode transcode,
                   const UpkeepTold& told) {
  const bool compresses = transcode == rig::RecordingConfig::Transcode::when_idle;
  Job job{v1::Job::SALVAGE, session.filename().string(), [session](const Observer& observer) -> JobResult {
            EMBERLOCK_ASSIGN_OR_RETURN(const session::SalvageReport report,
                                       session::salvage(session, observer));
            return session::to_outcome(report);
          }};
  job.ended = [session, &jobs, compresses, told](const JobResult& result) {
    if (told.salvaged) told.salvaged(session.filename().string(), result);
    if (result.ok() && compresses) compress_later(session, jobs, told);
  };
  static_cast<void>(jobs.add(std::move(job)));
}

void take_up(const session::SessionStore& store, Jobs& jobs, rig::RecordingConfig::Transcode transcode,
             const UpkeepTold& told) {
  for (const fs::path& session : store.unfinished()) salvage_later(session, jobs, transcode, told);
  if (transcode != rig::RecordingConfig::Transcode::when_idle) return;
  // Which are uncompressed shows by their files alone: of many sessions that takes a while.
  Job look;
  look.kind = v1::Job::COMPRESS;
  look.run = [&store, &jobs, told](const Observer& observer) -> JobResult {
    for (const fs::path& session : store.finished()) {
      EMBERLOCK_RETURN_IF_ERROR(observe(observer, 0, "looking for what is uncompressed"));
      compress_later(session, jobs, told);
    }
    return v1::JobOutcome();
  };
  static_cast<void>(jobs.add(std::move(look)));
}

}  // namespace emberlock::daemon
