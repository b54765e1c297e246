// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "base/unique_fd.h"

// Who may talk to the daemon. Over its Unix socket: whoever the folder's permissions let in. Over HTTP: a
// browser that followed one of the daemon's links (console_sessions.h), or who has the token. From elsewhere:
// who has the token.
namespace emberlock::rig {

/// What a file holds that must be kept from others. Error bad_input: others than its owner and its group can
/// read it, or others than its owner can write to it; `what` names the secret: "the token".
Result<std::string> read_secret_file(const std::filesystem::path& file, std::size_t max_bytes,
                                     std::string_view what);

/// 256 random bits as 64 hexadecimal digits. Error io: the kernel has none.
Result<std::string> random_secret();

/// The secret that clients from elsewhere show.
class Token {
 public:
  static constexpr std::size_t kShortest = 16;  ///< characters: letters, digits and - . _ ~ + / =
  static constexpr std::size_t kLongest = 256;

  static Result<Token> parse(std::string_view text);
  /// A file that holds it alone. Errors as read_secret_file; bad_input where it holds no token.
  static Result<Token> read(const std::filesystem::path& file);

  /// Takes as long whatever they have in common.
  [[nodiscard]] bool matches(std::string_view shown) const;

 private:
  explicit Token(std::string secret) : secret_(std::move(secret)) {}
  std::string secret_;
};

/// Writes a new token, of 256 random bits, that only its owner can read. Error bad_input: the file exists.
Status make_token(const std::filesystem::path& file);

/// What one side of TLS shows to prove who it is, as PEM.
struct TlsIdentity {
  std::string certificate;  ///< with those that vouch for it, if any
  std::string key;

  /// Errors say what is wrong with which file: absent, no PEM, the key of another certificate, out of date;
  /// of the key as read_secret_file, too.
  static Result<TlsIdentity> read(const std::filesystem::path& certificate, const std::filesystem::path& key);
};

/// How the daemon speaks TLS, to all who come by network.
struct ServerTls {
  TlsIdentity identity;
  std::string clients = {};  ///< PEM of who signs clients' certificates, demanded then; empty: none are

  /// `clients` may be empty. Errors as those of TlsIdentity.
  static Result<ServerTls> read(const std::filesystem::path& certificate, const std::filesystem::path& key,
                                const std::filesystem::path& clients);
};

/// The right to listen on a Unix socket: a lock on `socket`.lock, held until it goes, or until the process
/// dies however.
class SocketLock {
 public:
  /// Makes the socket's folder if need be (0750) and takes away a socket that a daemon left behind. Error
  /// refused: another daemon, whose pid it names, has it.
  static Result<SocketLock> take(const std::filesystem::path& socket);

 private:
  explicit SocketLock(UniqueFd file) : file_(std::move(file)) {}
  UniqueFd file_;
};

}  // namespace emberlock::rig
