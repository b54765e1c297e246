// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/client.h"

namespace emberlock::cli {

/// `emberlock align` without a rig of its own: asks the daemon.
struct DaemonAlignment {
  DaemonAddress daemon;
  v1::AlignRequest request;
  bool stop = false;  ///< instead: back to idle
  bool json = false;  ///< DaemonStatus, a line a round
};

/// Begins to align and shows each round until the cameras are locked. Leaves with exit code 1 where that is
/// refused or given up, kUnreachable without a daemon; Ctrl-C leaves the daemon aligning.
void align_by_daemon(const DaemonAlignment& wanted);

}  // namespace emberlock::cli
