// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>

#include "base/progress.h"
#include "base/result.h"

namespace emberlock::cli {

// Each function adds a verb; its callback does the work and returns normally or ends in fail().
void add_devices(CLI::App& app);
void add_clips(CLI::App& devices);
void add_smear(CLI::App& app);
void add_align(CLI::App& app);
void add_reconstruct(CLI::App& app);
/// `batch`, `batch submit` and `batch status`.
void add_batch(CLI::App& app);
void add_verify(CLI::App& app);
/// `verify-volume`.
void add_verify_volume(CLI::App& app);
void add_view(CLI::App& app);
void add_measure(CLI::App& app);
void add_render(CLI::App& app);
void add_scene(CLI::App& app);
void add_stylize(CLI::App& app);
void add_ar(CLI::App& app);
/// `marker`: what `ar` looks for, for printing.
void add_marker(CLI::App& app);
/// What emberlockd starts for the flame in live pictures; not among the verbs of the help.
void add_ar_live(CLI::App& app);
void add_reconstruct_live(CLI::App& app);
void add_export(CLI::App& app);
void add_tradeoff(CLI::App& app);
/// `evaluate paper`, which starts emberlock-paper.
void add_evaluate(CLI::App& app);
/// `tradeoff sync`; `parent` is the verb tradeoff.
void add_tradeoff_sync(CLI::App& parent);
/// `tradeoff rig`; `parent` is the verb tradeoff.
void add_tradeoff_rig(CLI::App& parent);
/// `calibrate cameras`, `check`, `convert` and `colour`.
void add_calibrate(CLI::App& app);
/// `calibrate check`; `parent` is the verb calibrate.
void add_calibrate_check(CLI::App& parent);
/// `calibrate colour`; `parent` is the verb calibrate.
void add_calibrate_colour(CLI::App& parent);
void add_import(CLI::App& app);
void add_demo(CLI::App& app);
void add_sample(CLI::App& app);
/// `simulate flame`.
void add_simulate(CLI::App& app);
void add_doctor(CLI::App& app);
void add_bench(CLI::App& app);
void add_design(CLI::App& app);
void add_sessions(CLI::App& app);
/// status, jobs, console, watch, record and strobe: those that only ask the daemon.
void add_client(CLI::App& app);
void add_status(CLI::App& app);
void add_jobs(CLI::App& app);
void add_console(CLI::App& app);
void add_watch(CLI::App& app);
void add_record(CLI::App& app);
void add_strobe(CLI::App& app);

/// Does what the command line asks for; the exit code.
int run(CLI::App& app, int argc, char** argv);

/// Prints "emberlock: <message>" on stderr and exits (by CLI::RuntimeError) with code 2 for bad input, else
/// 1.
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
