// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include "base/daemon_folders.h"
#include "cli/client.h"

namespace emberlock::cli {
namespace {

const char* const kDaemonGroup = "The daemon";

}  // namespace

std::string usual_daemon() {
  const char* const named = std::getenv("EMBERLOCK_DAEMON");
  return named == nullptr || *named == '\0' ? "unix:" + usual_socket().string() : named;
}

Option add_daemon_options(const Verb& verb, DaemonAddress& address) {
  const auto file = [&verb](const char* name, std::filesystem::path& path, const char* words,
                            const char* environment) {
    verb.add_option(name, path, words).read_environment(environment).set_type("FILE").set_group(kDaemonGroup);
  };
  const Option where =
      verb.add_option(
              "--daemon", address.address,
              "Address of emberlockd: unix:PATH or HOST:PORT [EMBERLOCK_DAEMON, else your own daemon's "
              "socket, else unix:/run/emberlock/emberlockd.sock]")
          .set_group(kDaemonGroup);
  file("--tls-ca", address.tls_ca,
       "HOST:PORT only: PEM of the authority that signed the daemon's certificate", "EMBERLOCK_TLS_CA");
  file("--token-file", address.token_file, "HOST:PORT only: file with the daemon's token",
       "EMBERLOCK_TOKEN_FILE");
  file("--tls-certificate", address.tls_certificate,
       "HOST:PORT only: PEM of this client's certificate, if the daemon wants one (tls_clients)",
       "EMBERLOCK_TLS_CERTIFICATE");
  file("--tls-key", address.tls_key, "HOST:PORT only: PEM of its private key", "EMBERLOCK_TLS_KEY");
  return where;
}

bool is_daemon_option(const Option& option) { return option.group() == kDaemonGroup; }

}  // namespace emberlock::cli
