// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"

namespace emberlock::cli {

// The strobe's code (smear_sync/clocks/frame_code.h) as other devices take it. `pattern` is one cycle, false
// skips a flash.

/// 0 and 1, a word and its pause (`spacing` flashes) on each line.
std::string code_text(const std::vector<bool>& pattern, int spacing);

/// "flash,start_s,width_s,lit" and a line for each flash: at 1 / rate from one to the next, whether it is
/// given or skipped. Skipped ones have width 0.
std::string code_csv(const std::vector<bool>& pattern, Hertz rate, Seconds width);

/// One cycle as a sound file (WAV, one channel, 16 bits): full level during a flash, else zero. A flash
/// begins at the nearest sample and lasts one at least. Error bad_input: too few samples for a flash and a
/// pause, or a file over 1 GB.
Result<std::string> code_wav(const std::vector<bool>& pattern, Hertz rate, Seconds width, Hertz samples);

}  // namespace emberlock::cli
