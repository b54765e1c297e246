// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include "cli/client.h"

namespace emberlock::cli {
namespace {

const char* const kDaemonGroup = "The daemon";

}  // namespace

std::string usual_daemon() {
  const char* const named = std::getenv("EMBERLOCK_DAEMON");
  return named == nullptr || *named == '\0' ? "unix:/run/emberlock/emberlockd.sock" : named;
}

CLI::Option* add_daemon_options(CLI::App& verb, DaemonAddress& address) {
  const auto file = [&verb](const char* name, std::filesystem::path& path, const char* words,
                            const char* environment) {
    verb.add_option(name, path, words)->envname(environment)->type_name("FILE")->group(kDaemonGroup);
  };
  CLI::Option* where =
      verb.add_option("--daemon", address.address,
                      "Where emberlockd is: unix:PATH or HOST:PORT; EMBERLOCK_DAEMON names another")
          ->capture_default_str()
          ->group(kDaemonGroup);
  file("--tls-ca", address.tls_ca, "Of HOST:PORT: PEM of who vouches for the daemon", "EMBERLOCK_TLS_CA");
  file("--token-file", address.token_file, "Of HOST:PORT: holds the daemon's token", "EMBERLOCK_TOKEN_FILE");
  file("--tls-certificate", address.tls_certificate,
       "Of HOST:PORT: PEM of this client, where the daemon wants one (tls_clients)",
       "EMBERLOCK_TLS_CERTIFICATE");
  file("--tls-key", address.tls_key, "Of HOST:PORT: PEM of its key", "EMBERLOCK_TLS_KEY");
  return where;
}

bool is_daemon_option(const CLI::Option& option) { return option.get_group() == kDaemonGroup; }

}  // namespace emberlock::cli
