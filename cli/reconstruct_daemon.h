// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/client.h"

namespace emberlock::cli {

/// `emberlock reconstruct SESSION --daemon`.
struct DaemonReconstruction {
  DaemonAddress daemon;
  v1::ReconstructRequest request;
  bool cancel = false;  ///< instead: the one that runs
  bool json = false;    ///< Iteration, a line each, and ReconstructionStatus at the end
};

/// Starts it and shows each iteration until it has ended. Leaves with exit code 1 where it failed or was
/// cancelled, kUnreachable without a daemon; Ctrl-C leaves the daemon reconstructing.
void reconstruct_by_daemon(const DaemonReconstruction& wanted);

}  // namespace emberlock::cli
