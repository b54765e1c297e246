// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "drivers/virtual/options.h"
#include "drivers/virtual/virtual_dial.h"
#include "rig/align/run.h"

namespace emberlock::cli {

/// The strobe of a virtual rig: one with an interface, or one with a dial and a simulated operator who turns
/// it as requested.
struct StrobeChoice {
  std::optional<drivers::VirtualDialOptions> dial;
  std::optional<Hertz> at;  ///< initial setting of the dial; default: the requested one
};

/// Parses "virtual", or "manual" and "virtual-dial" with options: "manual:step=1",
/// "virtual-dial:error=300,at=1510.5". Error bad_input otherwise.
Result<StrobeChoice> parse_strobe(const std::string& text);

/// Simulates the operator: first sets the dial to the requested rate, or to `at`, then turns it by the
/// requested amounts. `observer` gets each round before that. Without a dial, returns `observer`.
rig::AlignObserver operated(drivers::VirtualDial* dial, std::optional<Hertz> at, rig::AlignObserver observer);

}  // namespace emberlock::cli
