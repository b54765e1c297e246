// SPDX-License-Identifier: Apache-2.0
#include "daemon/work/upkeep.h"

#include <memory>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace emberlock::daemon {
namespace fs = std::filesystem;

bool is_uncompressed(const fs::path& session) {
  std::error_code ec;
  for (fs::recursive_directory_iterator at(session, ec), end; !ec && at != end; at.increment(ec)) {
    if (at->path().extension() == ".nut") return true;
  }
  return false;
}

Work salvage_of(const fs::path& session, std::function<void(const Result<session::SalvageReport>&)> done) {
  const auto report = std::make_shared<Result<session::SalvageReport>>(session::SalvageReport{});
  Work work;
  work.kind = v1::BackgroundJob::SALVAGE;
  work.session = session.filename().string();
  work.run = [session, report](const Observer& observer) -> Status {
    *report = session::salvage(session, observer);
    return report->ok() ? Status() : report->error();
  };
  work.done = [report, done = std::move(done)](const Status& /*outcome*/) {
    if (done) done(*report);
  };
  return work;
}

Status check_not_salvaged(const WorkQueue& queue, const std::string& session) {
  const auto job = queue.find(v1::BackgroundJob::SALVAGE, session);
  if (!job) return {};
  const bool begun = job->fraction() > 0;
  return Error{ErrorKind::refused,
               begun ? fmt::format("it is being salvaged, {:.0f} % are done", 100 * job->fraction())
                     : "it waits to be salvaged",
               "session " + session,
               job->state() == v1::BackgroundJob::PAUSED
                   ? "Salvage stands still while something is recorded: ask again after that"
                   : "Ask again when that is done; `emberlock status` shows how far it is"};
}

Work compression_of(const fs::path& session, std::function<void(const Status&)> done) {
  const auto needed = std::make_shared<bool>(false);
  Work work;
  work.kind = v1::BackgroundJob::COMPRESS;
  work.session = session.filename().string();
  work.run = [session, needed](const Observer& observer) -> Status {
    *needed = is_uncompressed(session);
    return *needed ? session::transcode(session, observer) : Status();
  };
  work.done = [needed, done = std::move(done)](const Status& outcome) {
    if (done && *needed) done(outcome);
  };
  return work;
}

void compress_later(const fs::path& session, WorkQueue& queue, const UpkeepTold& told) {
  if (!is_uncompressed(session)) return;
  queue.add(compression_of(session, [told, name = session.filename().string()](const Status& outcome) {
    if (told.compressed) told.compressed(name, outcome);
  }));
}

void salvage_later(const fs::path& session, WorkQueue& queue, rig::RecordingConfig::Transcode transcode,
                   const UpkeepTold& told) {
  const bool compresses = transcode == rig::RecordingConfig::Transcode::when_idle;
  queue.add(
      salvage_of(session, [session, &queue, compresses, told](const Result<session::SalvageReport>& outcome) {
        if (told.salvaged) told.salvaged(session.filename().string(), outcome);
        if (outcome.ok() && compresses) compress_later(session, queue, told);
      }));
}

void take_up(const session::SessionStore& store, WorkQueue& queue, rig::RecordingConfig::Transcode transcode,
             const UpkeepTold& told) {
  for (const fs::path& session : store.unfinished()) salvage_later(session, queue, transcode, told);
  if (transcode != rig::RecordingConfig::Transcode::when_idle) return;
  // Which are uncompressed shows by their files alone: of many sessions that takes a while.
  Work look;
  look.kind = v1::BackgroundJob::COMPRESS;
  look.run = [&store, &queue, told](const Observer& observer) -> Status {
    for (const fs::path& session : store.finished()) {
      EMBERLOCK_RETURN_IF_ERROR(observe(observer, 0, "looking for what is uncompressed"));
      compress_later(session, queue, told);
    }
    return {};
  };
  queue.add(std::move(look));
}

}  // namespace emberlock::daemon
