// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "base/progress.h"
#include "base/result.h"
#include "cli/command_line.h"

namespace emberlock::cli {

// Each function adds a verb; its callback does the work and returns normally or ends in fail().
void add_devices(const Verb& app);
void add_clips(const Verb& devices);
void add_smear(const Verb& app);
void add_align(const Verb& app);
void add_reconstruct(const Verb& app);
/// `batch`, `batch submit` and `batch status`.
void add_batch(const Verb& app);
void add_verify(const Verb& app);
/// `verify-volume`.
void add_verify_volume(const Verb& app);
void add_view(const Verb& app);
void add_measure(const Verb& app);
void add_render(const Verb& app);
void add_scene(const Verb& app);
void add_stylize(const Verb& app);
void add_ar(const Verb& app);
/// `marker`: what `ar` looks for, for printing.
void add_marker(const Verb& app);
/// What emberlockd starts for the flame in live pictures; not among the verbs of the help.
void add_ar_live(const Verb& app);
void add_reconstruct_live(const Verb& app);
void add_export(const Verb& app);
void add_tradeoff(const Verb& app);
/// `evaluate paper`.
void add_evaluate(const Verb& app);
/// `tradeoff sync`; `parent` is the verb tradeoff.
void add_tradeoff_sync(const Verb& parent);
/// `tradeoff rig`; `parent` is the verb tradeoff.
void add_tradeoff_rig(const Verb& parent);
/// `calibrate cameras`, `check`, `convert` and `colour`.
void add_calibrate(const Verb& app);
/// `calibrate check`; `parent` is the verb calibrate.
void add_calibrate_check(const Verb& parent);
/// `calibrate colour`; `parent` is the verb calibrate.
void add_calibrate_colour(const Verb& parent);
void add_import(const Verb& app);
void add_demo(const Verb& app);
void add_sample(const Verb& app);
/// `simulate flame`.
void add_simulate(const Verb& app);
void add_doctor(const Verb& app);
void add_bench(const Verb& app);
void add_design(const Verb& app);
void add_sessions(const Verb& app);
/// status, jobs, console, watch, record and strobe: those that only ask the daemon.
void add_client(const Verb& app);
void add_status(const Verb& app);
void add_jobs(const Verb& app);
void add_console(const Verb& app);
void add_watch(const Verb& app);
void add_record(const Verb& app);
void add_strobe(const Verb& app);

/// Does what the command line asks for; the exit code.
int run(const CommandLine& line, int argc, char** argv);

/// Prints "emberlock: <message>" on stderr and throws Exit: code 2 for bad input, else 1.
[[noreturn]] void fail(const Error& error);

/// The value, or fail().
template <class T>
T or_fail(Result<T> result) {
  if (!result) fail(result.error());
  return std::move(result).value();
}
inline void or_fail(const Status& status) {
  if (!status) fail(status.error());
}

/// A progress bar on stderr: redrawn in place on a terminal, else a line per tenth and at most one a second,
/// of all bars together; silent in the first two seconds.
Progress progress_bar(const std::string& title);

}  // namespace emberlock::cli
