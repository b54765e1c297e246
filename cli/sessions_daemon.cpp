// SPDX-License-Identifier: Apache-2.0
#include "cli/sessions_daemon.h"

#include <cstdio>

#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "cli/interrupt.h"

namespace emberlock::cli {
namespace {

Status run(Client& client, SessionJob job, const std::string& session,
           const Client::Take<v1::JobProgress>& take) {
  v1::SessionRequest request;
  request.set_session(session);
  v1::ExportRequest exporting;
  exporting.set_session(session);
  switch (job) {
    case SessionJob::verify:
      return client.verify(request, take, Interrupt::asked);
    case SessionJob::repair:
      return client.repair(request, take, Interrupt::asked);
    case SessionJob::export_png:
      exporting.set_format(v1::ExportRequest::PNG);
      break;
    case SessionJob::export_video:
      exporting.set_format(v1::ExportRequest::VIDEO);
      break;
  }
  return client.export_to(exporting, take, Interrupt::asked);
}

}  // namespace

v1::ListSessionsResponse sessions_of_daemon(const DaemonAddress& address) {
  Client client = connect_or_leave(address);
  return or_leave(client, client.list_sessions());
}

void job_by_daemon(const DaemonAddress& address, SessionJob job, const std::string& session, bool json) {
  Client client = connect_or_leave(address);
  const Interrupt interrupt;
  const Progress progress = progress_bar(session);
  v1::JobProgress last;
  or_leave(client, run(client, job, session, [&](const v1::JobProgress& told) {
             last = told;
             tell(progress, told.fraction(), told.doing());
             return true;
           }));
  if (!last.done()) leave(client, {ErrorKind::io, "it was ended before it was done", session});
  const auto told = nlohmann::json::parse(last.report(), nullptr, false);
  if (json) {
    std::printf("%s\n", last.report().c_str());
  } else {
    if (!told.is_discarded()) std::printf("%s\n", told.dump(2).c_str());
    std::printf("%s: %s\n", session.c_str(), last.ok() ? "all good" : "damaged, see above");
  }
  if (!last.ok()) throw CLI::RuntimeError(1);
}

}  // namespace emberlock::cli
