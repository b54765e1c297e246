// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "cli/client.h"

namespace emberlock::cli {

/// Whether a session, or a folder of them, is one of the daemon's: a plain name, or none. "./NAME" is a path.
inline bool is_daemons(const std::string& name) {
  return name.find('/') == std::string::npos && !name.starts_with('.');
}

v1::ListSessionsResponse sessions_of_daemon(const DaemonAddress& address);

enum class SessionJob { verify, repair, export_png, export_video };

/// Shows how far it is, and its report; leaves with exit code 1 where the daemon says that it isn't well.
/// Ctrl-C ends it.
void job_by_daemon(const DaemonAddress& address, SessionJob job, const std::string& session, bool json);

}  // namespace emberlock::cli
