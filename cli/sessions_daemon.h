// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cli/client.h"

namespace emberlock::cli {

/// Whether a session (or a folder of them) is the daemon's: a plain name, or none. "./NAME" is a path.
inline bool is_daemons(const std::string& name) {
  return name.find('/') == std::string::npos && !name.starts_with('.');
}

/// Whether the daemon has a session of this name; false where no daemon answers.
bool daemon_has(const DaemonAddress& address, const std::string& name);

v1::ListSessionsResponse sessions_of_daemon(const DaemonAddress& address);

enum class SessionJob { verify, repair, export_png, export_video };

/// Runs a job and shows its progress; exits with code 1 if it fails. Ctrl-C cancels the job.
v1::JobOutcome job_by_daemon(const DaemonAddress& address, SessionJob job, const std::string& session);

}  // namespace emberlock::cli
