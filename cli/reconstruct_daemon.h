// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/client.h"

namespace emberlock::cli {

/// Options of `emberlock reconstruct SESSION --daemon`.
struct DaemonReconstruction {
  DaemonAddress daemon;
  v1::ReconstructRequest request;
  bool cancel = false;  ///< instead of reconstructing: cancels the running one
  bool json = false;    ///< one Iteration per line, and ReconstructionStatus at the end
};

/// Starts a reconstruction and shows each iteration until it ends. Exits with code 1 if it failed or was
/// cancelled, kUnreachable without a daemon. After Ctrl-C the daemon continues.
void reconstruct_by_daemon(const DaemonReconstruction& wanted);

}  // namespace emberlock::cli
