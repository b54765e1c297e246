// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include "daemon/server/auth_failures.h"
#include "emberlock/v1/status.pb.h"

namespace emberlock::daemon {

/// Resource usage of this process, by the operating system.
struct ProcessUsage {
  double cpu_s = 0;
  std::uint64_t resident_bytes = 0;
  std::size_t open_files = 0;
  double start_s = 0;  ///< since 1970-01-01 UTC
};
/// Values that can't be read are 0.
ProcessUsage process_usage();

/// Counts of the clients.
struct ClientCounts {
  std::size_t viewers = 0;                                                   ///< consoles
  std::size_t other_watchers = 0;                                            ///< gRPC's streams
  std::map<std::string, std::array<std::uint64_t, kRefusals>> refused = {};  ///< see AuthFailures::counts
};

/// All metrics in Prometheus' text format, version 0.0.4.
std::string metrics_text(const v1::DaemonStatus& status, const ProcessUsage& process,
                         const ClientCounts& clients);

}  // namespace emberlock::daemon
