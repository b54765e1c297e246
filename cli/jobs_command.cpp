// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <cstdio>
#include <memory>

#include "cli/client.h"
#include "cli/commands.h"
#include "cli/daemon_words.h"

namespace emberlock::cli {
namespace {

struct JobsArguments {
  DaemonAddress daemon;
  std::uint64_t id = 0;
  bool json = false;
};

void list_jobs(const JobsArguments& arguments) {
  Client client = connect_or_leave(arguments.daemon);
  v1::DaemonStatus shown;
  *shown.mutable_jobs() = or_leave(client, client.status()).jobs();
  if (arguments.json) {
    std::printf("%s\n", json_line(shown).c_str());
    return;
  }
  if (shown.jobs().empty()) std::printf("No jobs.\n");
  for (const v1::Job& job : shown.jobs())
    std::printf("%4llu  %s\n", static_cast<unsigned long long>(job.id()), job_line(job).c_str());
}

void cancel_job(const JobsArguments& arguments) {
  Client client = connect_or_leave(arguments.daemon);
  v1::CancelJobRequest request;
  request.set_id(arguments.id);
  or_leave(client, client.cancel_job(request));
}

}  // namespace

void add_jobs(const Verb& app) {
  auto arguments = std::make_shared<JobsArguments>();
  const Verb verb = app.add_verb(
      "jobs",
      "Lists the daemon's jobs (salvage, verification, export, reconstruction, ...); `jobs cancel` ends one");
  add_daemon_options(verb, arguments->daemon);
  verb.add_flag("--json", arguments->json, "The jobs (emberlock/v1/jobs.proto), as JSON on one line");
  verb.allow_verb();
  const Verb cancel =
      verb.add_verb("cancel", "Ends a job. Salvage, compression and repair continue from there later");
  cancel.add_option("ID", arguments->id, "The job's number, as `emberlock jobs` prints it").require();
  add_daemon_options(cancel, arguments->daemon);
  cancel.set_action([arguments] { cancel_job(*arguments); });
  verb.set_action([arguments, verb] {
    if (!verb.verb_is_given()) list_jobs(*arguments);
  });
}

}  // namespace emberlock::cli
