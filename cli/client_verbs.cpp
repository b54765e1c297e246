// SPDX-License-Identifier: Apache-2.0
#include "cli/commands.h"

namespace emberlock::cli {

void add_client(const Verb& app) {
  add_status(app);
  add_jobs(app);
  add_console(app);
  add_watch(app);
  add_record(app);
  add_strobe(app);
}

}  // namespace emberlock::cli
