// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace emberlock::paper {

/// Runs `emberlock-paper`: parses the options, evaluates, prints and writes the report. Returns the exit
/// code: 0 done, 1 failed, 2 the command line or an input is wrong.
int run_command(int argc, const char* const* argv);

}  // namespace emberlock::paper
