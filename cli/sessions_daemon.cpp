// SPDX-License-Identifier: Apache-2.0
#include "cli/sessions_daemon.h"

#include <algorithm>

#include "cli/commands.h"
#include "cli/daemon_words.h"
#include "cli/interrupt.h"

namespace emberlock::cli {
namespace {

Status run(Client& client, SessionJob job, const std::string& session, const Client::Take<v1::Job>& take) {
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

bool daemon_has(const DaemonAddress& address, const std::string& name) {
  auto client = Client::connect(address);
  if (!client) return false;
  const auto listed = client->list_sessions();
  return listed && std::any_of(listed->sessions().begin(), listed->sessions().end(),
                               [&](const auto& entry) { return entry.session() == name; });
}

v1::ListSessionsResponse sessions_of_daemon(const DaemonAddress& address) {
  Client client = connect_or_leave(address);
  return or_leave(client, client.list_sessions());
}

v1::JobOutcome job_by_daemon(const DaemonAddress& address, SessionJob job, const std::string& session) {
  Client client = connect_or_leave(address);
  const Interrupt interrupt;
  const Progress progress = progress_bar(session);
  v1::Job last;
  or_leave(client, run(client, job, session, [&](const v1::Job& told) {
             last = told;
             tell(progress, told.fraction(), told.doing());
             return true;
           }));
  if (last.state() != v1::Job::DONE)
    leave(client, {ErrorKind::io, "it was ended before it was done", session});
  return last.outcome();
}

}  // namespace emberlock::cli
