// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "base/unique_fd.h"

// Access to the daemon. Over its Unix socket: users permitted by the folder's mode. Over HTTP: a browser that
// followed one of the daemon's links (console_sessions.h), or a client with the token. From other machines:
// clients with the token.
namespace emberlock::rig {

/// 256 random bits as 64 hexadecimal digits. Error io: the kernel provides none.
Result<std::string> random_secret();

/// The secret that remote clients present.
class Token {
 public:
  static constexpr std::size_t kShortest = 16;  ///< characters: letters, digits and - . _ ~ + / =
  static constexpr std::size_t kLongest = 256;

  static Result<Token> parse(std::string_view text);
  /// Reads a file that contains only the token. Errors as read_secret_file; bad_input where it isn't a token.
  static Result<Token> read(const std::filesystem::path& file);

  /// Compares in constant time.
  [[nodiscard]] bool matches(std::string_view shown) const;

 private:
  explicit Token(std::string secret) : secret_(std::move(secret)) {}
  std::string secret_;
};

/// Writes a new token of 256 random bits to a file that only its owner can read. Error bad_input: the file
/// exists.
Status make_token(const std::filesystem::path& file);

/// The TLS certificate and key of one side, as PEM.
struct TlsIdentity {
  std::string certificate;  ///< followed by its chain, if any
  std::string key;

  /// Errors name the file and its fault: absent, not PEM, the key of another certificate, expired or not yet
  /// valid, too weak for OpenSSL; for the key also those of read_secret_file.
  static Result<TlsIdentity> read(const std::filesystem::path& certificate, const std::filesystem::path& key);
};

/// The certificates of an authority, as PEM. Errors name the file: absent, not PEM, expired or not yet valid.
Result<std::string> read_authority(const std::filesystem::path& file);

/// The daemon's TLS settings for network clients.
struct ServerTls {
  TlsIdentity identity;
  std::string clients = {};  ///< PEM of the authority that signs clients' certificates, which are then
                             ///< required; empty: not required

  /// `clients` may be empty. Errors as those of TlsIdentity.
  static Result<ServerTls> read(const std::filesystem::path& certificate, const std::filesystem::path& key,
                                const std::filesystem::path& clients);
};

/// The exclusive right to listen on a Unix socket: a lock on `socket`.lock, held until this object is
/// destroyed or the process ends in any way.
class SocketLock {
 public:
  /// Creates the socket's folder if necessary (0750 as root, else 0700) and removes a socket that a daemon
  /// left behind. Errors: those of check(); refused: another daemon, whose pid is named, holds the lock.
  static Result<SocketLock> take(const std::filesystem::path& socket);
  /// What take() refuses of a path, found without touching it. Errors: bad_input (too long, no socket, its
  /// folder can't be made), refused (the folder is another user's).
  static Status check(const std::filesystem::path& socket);

 private:
  explicit SocketLock(UniqueFd file) : file_(std::move(file)) {}
  UniqueFd file_;
};

}  // namespace emberlock::rig
