// SPDX-License-Identifier: Apache-2.0
#include "rig/config/preflight.h"

#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <unistd.h>

#include "base/file.h"
#include "base/secret_file.h"
#include "recon/calibrate/transforms.h"
#include "rig/access.h"
#include "session/reader.h"

namespace emberlock::rig {
namespace {
namespace fs = std::filesystem;

constexpr std::size_t kLargestSecret = 1 << 20;

class Preflight {
 public:
  std::vector<Error> of(const DaemonConfig& config) {
    const ServerConfig& server = config.server;
    folder_for_writing("recording.folder", config.recording.folder);
    if (!config.alignment.delays.empty())
      folder_for_writing("alignment.delays", config.alignment.delays.parent_path());
    if (!server.socket.empty()) socket(server.socket);
    tls("server.tls_certificate", server.tls_certificate, "server.tls_key", server.tls_key,
        "server.tls_clients", server.tls_clients);
    tls("hosts.certificate", config.hosts.certificate, "hosts.key", config.hosts.key, "hosts.authority",
        config.hosts.authority);
    if (!server.token_file.empty()) {
      if (const auto token = Token::read(server.token_file); !token)
        problem("server.token_file", server.token_file, token.error().what, token.error().remedy);
    }
    program(config.reconstruction.program);
    calibration(config.rig.calibration);
    replay(config.rig.replay_session);
    return std::move(problems_);
  }

 private:
  void problem(const char* key, const fs::path& path, std::string what, std::string remedy) {
    problems_.push_back({ErrorKind::bad_input, std::move(what), fmt::format("{}, {}", key, path.string()),
                         std::move(remedy)});
  }

  /// Checks that it exists and is writable, or can be created.
  void folder_for_writing(const char* key, const fs::path& folder) {
    std::error_code ignored;
    fs::path there = folder.empty() ? "." : folder;
    while (!fs::exists(there, ignored) && there.has_relative_path()) there = there.parent_path();
    if (there.empty()) there = ".";
    if (!fs::is_directory(there, ignored)) {
      problem(key, there, "this is no folder", "name another");
    } else if (::access(there.c_str(), W_OK | X_OK) != 0) {
      problem(key, there, fmt::format("can't be written to: {}", std::strerror(errno)),
              "give it to the daemon's user: chown emberlock: " + there.string());
    }
  }

  void socket(const fs::path& path) {
    if (const Status fit = SocketLock::check(path); !fit)
      return problem("server.socket", path, fit.error().what, fit.error().remedy);
    const fs::path folder = path.parent_path();
    std::error_code unknown;
    folder_for_writing("server.socket", fs::is_directory(folder, unknown) ? folder : folder.parent_path());
  }

  /// Reads them as the start does. Where there is no certificate, it reads none of them.
  void tls(const char* certificate_key, const fs::path& certificate, const char* key_key, const fs::path& key,
           const char* authority_key, const fs::path& authority) {
    if (certificate.empty()) return;
    if (const auto own = TlsIdentity::read(certificate, key); !own) {
      const bool is_key = own.error().where == key.string();
      problem(is_key ? key_key : certificate_key, is_key ? key : certificate, own.error().what,
              own.error().remedy);
      // One run names both.
      const auto secret = read_secret_file(key, kLargestSecret, "the key");
      if (!is_key && !secret) problem(key_key, key, secret.error().what, secret.error().remedy);
    }
    if (authority.empty()) return;
    if (const auto pem = read_authority(authority); !pem)
      problem(authority_key, authority, pem.error().what, pem.error().remedy);
  }

  void program(const fs::path& path) {
    if (path.has_parent_path() && ::access(path.c_str(), X_OK) != 0)
      problem("reconstruction.program", path, fmt::format("can't be run: {}", std::strerror(errno)),
              "name the emberlock program");
  }

  void calibration(const fs::path& file) {
    if (file.empty()) return;
    const auto transforms = recon::read_transforms(file);
    if (!transforms) problems_.push_back(transforms.error());
  }

  void replay(const fs::path& folder) {
    if (folder.empty()) return;
    const auto session = session::SessionReader::open(folder);
    if (!session) problems_.push_back(session.error());
  }

  std::vector<Error> problems_;
};

}  // namespace

std::vector<Error> preflight(const DaemonConfig& config) { return Preflight().of(config); }

std::vector<Error> check_config(const std::filesystem::path& file) {
  const auto text = read_file(file, kLargestSecret);
  if (!text) return {text.error()};
  ConfigReading reading = read_config(*text, file);
  if (!reading.problems.empty()) return std::move(reading.problems);
  std::error_code unknown;
  fill_in(reading.config, daemon_folders(), fs::read_symlink("/proc/self/exe", unknown));
  return preflight(reading.config);
}

}  // namespace emberlock::rig
