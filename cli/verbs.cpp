// SPDX-License-Identifier: Apache-2.0
// libexec/emberlock/emberlock: every verb. bin/emberlock (main.cpp) hands on to it.
#include "base/version.h"
#include "cli/commands.h"
#include "cli/help.h"
#include "cli/manual.h"

int main(int argc, char** argv) {
  const emberlock::cli::CommandLine line(
      "Emberlock: locks cameras without trigger hardware, films flames with them, reconstructs the volume.");
  const emberlock::cli::Verb& app = line.program();
  app.require_verb();
  emberlock::cli::style_help(app);
  app.add_version_flag("emberlock " + emberlock::version());
#if EMBERLOCK_WITH_DRIVERS
  emberlock::cli::add_devices(app);
#endif
  emberlock::cli::add_smear(app);
#if EMBERLOCK_WITH_DRIVERS
  emberlock::cli::add_align(app);
#endif
  emberlock::cli::add_import(app);
  emberlock::cli::add_calibrate(app);
  emberlock::cli::add_reconstruct(app);
  emberlock::cli::add_batch(app);
  emberlock::cli::add_verify_volume(app);
  emberlock::cli::add_view(app);
  emberlock::cli::add_render(app);
  emberlock::cli::add_scene(app);
  emberlock::cli::add_stylize(app);
  emberlock::cli::add_ar(app);
  emberlock::cli::add_ar_live(app);
  emberlock::cli::add_reconstruct_live(app);
  emberlock::cli::add_marker(app);
  emberlock::cli::add_export(app);
  emberlock::cli::add_measure(app);
  emberlock::cli::add_verify(app);
  emberlock::cli::add_tradeoff(app);
  emberlock::cli::add_evaluate(app);
#if EMBERLOCK_WITH_DRIVERS
  emberlock::cli::add_demo(app);
  emberlock::cli::add_sample(app);
  emberlock::cli::add_simulate(app);
#endif
  emberlock::cli::add_sessions(app);
#if EMBERLOCK_WITH_DRIVERS
  emberlock::cli::add_doctor(app);
  emberlock::cli::add_bench(app);
  emberlock::cli::add_design(app);
#endif
#if EMBERLOCK_WITH_DAEMON
  emberlock::cli::add_client(app);
#endif
  emberlock::cli::add_help(app);
  emberlock::cli::add_manual(app, emberlock::version());
  return emberlock::cli::run(line, argc, argv);
}
