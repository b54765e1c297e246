// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "cli/client.h"

namespace emberlock::cli {

enum class AlignDetail {
  changes,  ///< what is done, what goes wrong, what somebody has to do
  all,      ///< every camera of every round
};

/// Options of `emberlock align` with the daemon's rig.
struct DaemonAlignment {
  DaemonAddress daemon;
  v1::AlignRequest request;
  std::optional<double> renew_for;  ///< seconds: instead of aligning anew
  bool stop = false;                ///< instead of aligning: back to idle
  bool json = false;                ///< DaemonStatus, one line per round
  AlignDetail detail = AlignDetail::changes;
};

/// Starts an alignment and shows each round until the cameras are locked. Exits with code 1 if it is refused
/// or given up, kUnreachable without a daemon. After Ctrl-C the daemon continues to align.
void align_by_daemon(const DaemonAlignment& wanted);

}  // namespace emberlock::cli
