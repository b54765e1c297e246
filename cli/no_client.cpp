// SPDX-License-Identifier: Apache-2.0
// Replaces the daemon's client if EMBERLOCK_DAEMON is off.
#include <string>
#include <utility>

#include "cli/align_daemon.h"
#include "cli/commands.h"
#include "cli/reconstruct_daemon.h"
#include "cli/sessions_daemon.h"

namespace emberlock::cli {
namespace {

[[noreturn]] void no_client(std::string remedy) {
  fail({ErrorKind::refused,
        "this emberlock was built without the daemon's client (EMBERLOCK_DAEMON=OFF)",
        {},
        std::move(remedy)});
}

constexpr const char* kFolder = "Name a folder (./NAME for one here), or use a build with it";

}  // namespace

void reconstruct_by_daemon(const DaemonReconstruction&) { no_client(kFolder); }
bool daemon_has(const DaemonAddress&, const std::string&) { return false; }
v1::ListSessionsResponse sessions_of_daemon(const DaemonAddress&) { no_client(kFolder); }
v1::JobOutcome job_by_daemon(const DaemonAddress&, SessionJob, const std::string&) { no_client(kFolder); }
void align_by_daemon(const DaemonAlignment&) { no_client("Give --rig, or use a build with it"); }

}  // namespace emberlock::cli
