// SPDX-License-Identifier: Apache-2.0
#include "cli/commands.h"
#include "cli/manual.h"

int main(int argc, char** argv) {
  CLI::App app{
      "Emberlock: locks cameras without trigger hardware, films flames with them, reconstructs the volume.",
      "emberlock"};
  app.require_subcommand(1);
  app.set_version_flag("--version", "emberlock " EMBERLOCK_VERSION);
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
  emberlock::cli::add_verify(app);
  emberlock::cli::add_tradeoff(app);
#if EMBERLOCK_WITH_DRIVERS
  emberlock::cli::add_demo(app);
#endif
  emberlock::cli::add_sessions(app);
#if EMBERLOCK_WITH_DRIVERS
  emberlock::cli::add_doctor(app);
#endif
#if EMBERLOCK_WITH_DAEMON
  emberlock::cli::add_status(app);
  emberlock::cli::add_console(app);
  emberlock::cli::add_watch(app);
  emberlock::cli::add_record(app);
  emberlock::cli::add_strobe(app);
#endif
  emberlock::cli::add_manual(app, EMBERLOCK_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::RuntimeError& e) {
    return e.get_exit_code();
  } catch (const CLI::ParseError& e) {
    app.exit(e);
    return 2;
  }
}
