// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>

#include "cli/client.h"
#include "cli/commands.h"
#include "cli/daemon_words.h"

namespace emberlock::cli {
namespace {

struct ConsoleArguments {
  DaemonAddress daemon;
  bool json = false;
};

void print_link(const ConsoleArguments& arguments) {
  Client client = connect_or_leave(arguments.daemon);
  const v1::ConsoleLink link = or_leave(client, client.open_console());
  if (arguments.json) {
    std::printf("%s\n", json_line(link).c_str());
    return;
  }
  std::printf("%s\n", link.url().c_str());
  // The link gives full control of the rig. stdout is only the link, for programs that open it.
  std::fprintf(stderr,
               "Opens the console in one browser, once, within %.0f s; then that browser is let in.\n",
               link.valid_s());
}

}  // namespace

void add_console(const Verb& app) {
  auto arguments = std::make_shared<ConsoleArguments>();
  const Verb verb = app.add_verb(
      "console", "Prints a link that opens the console in a browser. The daemon must be on this machine");
  add_daemon_options(verb, arguments->daemon);
  verb.add_flag("--json", arguments->json, "ConsoleLink of emberlock/v1/services.proto, as JSON on one line");
  verb.set_action([arguments] { print_link(*arguments); });
}

}  // namespace emberlock::cli
