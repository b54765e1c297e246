// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>

#include "cli/client.h"
#include "cli/commands.h"
#include "cli/daemon_words.h"

namespace emberlock::cli {
namespace {

struct StatusArguments {
  DaemonAddress daemon;
  bool acknowledge = false;
  bool json = false;
};

void show_status(const StatusArguments& arguments) {
  Client client = connect_or_leave(arguments.daemon);
  if (arguments.acknowledge) or_leave(client, client.acknowledge(v1::AcknowledgeRequest()));
  const v1::DaemonStatus status = or_leave(client, client.status());
  std::printf("%s", arguments.json ? (json_line(status) + "\n").c_str() : status_screen(status).c_str());
  if (status.light() == v1::RED) throw Exit(1);
}

}  // namespace

void add_status(const Verb& app) {
  auto arguments = std::make_shared<StatusArguments>();
  const Verb verb = app.add_verb(
      "status",
      "Says what the rig is doing, what is wrong and what to do about it; exit code 1 if the state is red");
  add_daemon_options(verb, arguments->daemon);
  verb.add_flag("--acknowledge", arguments->acknowledge, "Remove faults that are over from the list");
  verb.add_flag("--json", arguments->json, "DaemonStatus of emberlock/v1/status.proto, as JSON on one line");
  verb.set_action([arguments] { show_status(*arguments); });
}

}  // namespace emberlock::cli
