// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "base/quantity.h"
#include "cli/command_line.h"
#include "smear_sync/verify/clip_clock.h"

namespace emberlock::cli {

/// How to read clips of a strobe, as typed.
struct ClipArguments {
  double flash_rate = 0;
  double row_time_us = 0;
  std::string comb;
  double comb_rate = 0;
  double frame_rate = 0;
  std::string direction;
  int shifts = 0;
  smear::FrameCode code{};
  double flash_width_us = 20;
};

/// Adds the options to a verb and returns --flash-rate, which the verb may require.
Option add_clip_options(const Verb& verb, ClipArguments& arguments);

/// All options except the row time.
smear::ClipOptions clip_options_of(const ClipArguments& arguments);

/// As given by the user.
std::optional<SecondsPerRow> row_time_of(const ClipArguments& arguments);

}  // namespace emberlock::cli
