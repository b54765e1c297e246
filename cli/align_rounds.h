// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cli/align_daemon.h"
#include "rig/align/run.h"

namespace emberlock::cli {

/// The rounds of an alignment as lines.
class AlignRounds {
 public:
  explicit AlignRounds(AlignDetail detail) : detail_(detail) {}

  /// A round's lines; empty if it changed nothing.
  std::string take(const rig::AlignRoundReport& report);

 private:
  std::string changes(const rig::AlignRoundReport& report);

  AlignDetail detail_;
  std::vector<smear::CameraCause> causes_;  ///< by camera, of the last round
  std::optional<smear::AlignCause> reason_;
  std::string dial_, asked_;  ///< what was last said to whoever sets the strobe
};

/// The result: verdict, what was measured of each sensor, and the cameras on the circle of a frame's rows.
std::string align_summary(const rig::AlignRunResult& result);

}  // namespace emberlock::cli
