// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "drivers/virtual/options.h"
#include "drivers/virtual/virtual_dial.h"
#include "rig/align/run.h"

namespace emberlock::cli {

/// What a virtual rig's strobe is: one that is told what to do, or one with a dial and somebody who turns it
/// as he is told.
struct StrobeChoice {
  std::optional<drivers::VirtualDialOptions> dial;
  std::optional<Hertz> at;  ///< where the dial is set at first; else where it is asked to be
};

/// From "virtual", or "manual" and "virtual-dial" with options: "manual:step=1",
/// "virtual-dial:error=300,at=1510.5". Error bad_input otherwise.
Result<StrobeChoice> parse_strobe(const std::string& text);

/// Plays whoever turns the dial: sets what is asked for at first, or `at`, then turns by as much as is said;
/// `observer` sees each round before. Just `observer` without a dial.
rig::AlignObserver operated(drivers::VirtualDial* dial, std::optional<Hertz> at, rig::AlignObserver observer);

}  // namespace emberlock::cli
