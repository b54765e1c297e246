// SPDX-License-Identifier: Apache-2.0
#include "rig/access.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/file.h"
#include "base/secret_file.h"

namespace emberlock::rig {
namespace {

namespace fs = std::filesystem;

Error os_error(const fs::path& path, std::string_view doing, std::string remedy = {}) {
  return {ErrorKind::io, fmt::format("{} failed: {}", doing, std::generic_category().message(errno)),
          path.string(), std::move(remedy)};
}

constexpr std::size_t kLargestPem = 1 << 20;

bool fit_for_a_token(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
         std::string_view("-._~+/=").find(c) != std::string_view::npos;
}

template <auto function>
struct Free {
  template <class T>
  void operator()(T* pointer) const {
    function(pointer);
  }
};
using Bio = std::unique_ptr<BIO, Free<BIO_free>>;
using Certificate = std::unique_ptr<X509, Free<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY_free>>;
using TlsContext = std::unique_ptr<SSL_CTX, Free<SSL_CTX_free>>;

Bio bio_of(const std::string& pem) { return Bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()))); }

/// Returns no password, because a daemon without a terminal can't ask for one.
int no_password(char* /*buffer*/, int /*size*/, int /*writing*/, void* /*user*/) { return 0; }

/// Parses the first certificate in the file.
Result<Certificate> parse_certificate(const std::string& pem, const fs::path& file) {
  Certificate first(PEM_read_bio_X509(bio_of(pem).get(), nullptr, no_password, nullptr));
  if (!first)
    return Error{ErrorKind::bad_input, "holds no certificate in PEM", file.string(),
                 "its first line is -----BEGIN CERTIFICATE-----"};
  if (X509_cmp_current_time(X509_get0_notAfter(first.get())) <= 0)
    return Error{ErrorKind::bad_input, "has run out", file.string(), "renew the certificate"};
  if (X509_cmp_current_time(X509_get0_notBefore(first.get())) > 0)
    return Error{ErrorKind::bad_input, "isn't valid yet", file.string(),
                 "set this machine's clock, or make the certificate again"};
  return first;
}

/// Has OpenSSL judge the certificate as a server's: its level of security refuses short keys and old hashes.
Status check_strength(X509* certificate, const fs::path& file) {
  const TlsContext context(SSL_CTX_new(TLS_server_method()));
  ERR_clear_error();
  if (context && SSL_CTX_use_certificate(context.get(), certificate) == 1) return {};
  const char* const reason = ERR_reason_error_string(ERR_get_error());
  return Error{ErrorKind::bad_input,
               fmt::format("is refused by OpenSSL ({})", reason == nullptr ? "for no stated reason" : reason),
               file.string(), "make it with a key of 256 bits (EC) or 2048 bits (RSA), and SHA-256"};
}

}  // namespace

Result<std::string> random_secret() {
  std::array<unsigned char, 32> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    return os_error("the kernel's random numbers", "getrandom");
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

Result<Token> Token::parse(std::string_view text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.remove_suffix(1);
  if (text.size() < kShortest || text.size() > kLongest ||
      !std::all_of(text.begin(), text.end(), fit_for_a_token))
    return Error{ErrorKind::bad_input,
                 fmt::format("no token: {} to {} letters, digits and -._~+/= are one", kShortest, kLongest),
                 "", "make one with `emberlockd --make-token FILE`"};
  return Token(std::string(text));
}

Result<Token> Token::read(const fs::path& file) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_secret_file(file, 4096, "the token"));
  auto token = parse(text);
  if (token) return token;
  Error error = token.error();
  error.where = file.string();
  return error;
}

bool Token::matches(std::string_view shown) const {
  return shown.size() == secret_.size() && CRYPTO_memcmp(shown.data(), secret_.data(), secret_.size()) == 0;
}

Status make_token(const fs::path& file) {
  EMBERLOCK_ASSIGN_OR_RETURN(std::string text, random_secret());
  text += '\n';
  const UniqueFd out(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR));
  if (!out && errno == EEXIST)
    return Error{ErrorKind::bad_input, "exists already", file.string(),
                 "remove it first, if no client needs it any more"};
  if (!out) return os_error(file, "open");
  if (::write(out.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size()))
    return os_error(file, "write");
  return {};
}

Result<TlsIdentity> TlsIdentity::read(const fs::path& certificate, const fs::path& key) {
  TlsIdentity identity;
  EMBERLOCK_ASSIGN_OR_RETURN(identity.certificate, read_file(certificate, kLargestPem));
  EMBERLOCK_ASSIGN_OR_RETURN(identity.key, read_secret_file(key, kLargestPem, "the key"));
  EMBERLOCK_ASSIGN_OR_RETURN(const Certificate shown, parse_certificate(identity.certificate, certificate));
  const Key secret(PEM_read_bio_PrivateKey(bio_of(identity.key).get(), nullptr, no_password, nullptr));
  if (!secret)
    return Error{ErrorKind::bad_input, "holds no private key in PEM, or one with a password", key.string(),
                 "take the password off: openssl pkey -in KEY -out NEW"};
  if (X509_check_private_key(shown.get(), secret.get()) != 1)
    return Error{ErrorKind::bad_input, fmt::format("is not the key of {}", certificate.string()),
                 key.string(), "name the key that the certificate was made with"};
  EMBERLOCK_RETURN_IF_ERROR(check_strength(shown.get(), certificate));
  return identity;
}

Result<std::string> read_authority(const fs::path& file) {
  EMBERLOCK_ASSIGN_OR_RETURN(std::string pem, read_file(file, kLargestPem));
  EMBERLOCK_RETURN_IF_ERROR(parse_certificate(pem, file));
  return pem;
}

Result<ServerTls> ServerTls::read(const fs::path& certificate, const fs::path& key, const fs::path& clients) {
  ServerTls tls;
  EMBERLOCK_ASSIGN_OR_RETURN(tls.identity, TlsIdentity::read(certificate, key));
  if (clients.empty()) return tls;
  EMBERLOCK_ASSIGN_OR_RETURN(tls.clients, read_authority(clients));
  return tls;
}

namespace {

/// Whether there is nothing, or a socket that a daemon left behind.
Status check_place(const fs::path& socket) {
  struct stat found {};
  if (::lstat(socket.c_str(), &found) != 0 || S_ISSOCK(found.st_mode)) return {};
  return Error{ErrorKind::bad_input, "is there already, and no socket", socket.string(),
               "choose another path"};
}

/// Removes a socket left behind by a daemon that no longer holds the lock; never any other file.
Status remove_stale(const fs::path& socket) {
  EMBERLOCK_RETURN_IF_ERROR(check_place(socket));
  if (::unlink(socket.c_str()) != 0 && errno != ENOENT) return os_error(socket, "unlink");
  return {};
}

/// A folder of somebody else's would let them put their own socket there.
Status check_owner(const fs::path& folder) {
  struct stat found {};
  const uid_t user = ::geteuid();
  if (user == 0 || ::lstat(folder.c_str(), &found) != 0 || found.st_uid == user || found.st_uid == 0)
    return {};
  return Error{ErrorKind::refused, fmt::format("belongs to another user (uid {})", found.st_uid),
               folder.string(), "choose another path for the socket"};
}

/// An ordinary user's is for them alone; their group may be everybody's.
Status make_folder(const fs::path& folder) {
  if (folder.empty() || fs::is_directory(folder)) return {};
  const mode_t group = ::geteuid() == 0 ? S_IRGRP | S_IXGRP : 0;
  if (::mkdir(folder.c_str(), S_IRWXU | group) == 0) return {};
  return os_error(folder, "mkdir", "make the folder, or choose another path for the socket");
}

}  // namespace

Status SocketLock::check(const fs::path& socket) {
  if (socket.native().size() >= sizeof(sockaddr_un::sun_path))
    return Error{
        ErrorKind::bad_input,
        fmt::format("too long for a socket: {} characters at most", sizeof(sockaddr_un::sun_path) - 1),
        socket.string(), "choose a shorter path"};
  const fs::path folder = socket.parent_path();
  std::error_code unknown;
  const fs::path above = folder.parent_path();
  if (fs::exists(folder, unknown) && !fs::is_directory(folder, unknown))
    return Error{ErrorKind::bad_input, "this is no folder", folder.string(),
                 "choose another path for the socket"};
  if (!folder.empty() && !fs::is_directory(folder, unknown) && !above.empty() &&
      !fs::is_directory(above, unknown))
    return Error{ErrorKind::bad_input, "there is no folder " + above.string(), socket.string(),
                 "make the folder, or choose another path for the socket"};
  EMBERLOCK_RETURN_IF_ERROR(check_owner(folder));
  return check_place(socket);
}

Result<SocketLock> SocketLock::take(const fs::path& socket) {
  EMBERLOCK_RETURN_IF_ERROR(check(socket));
  EMBERLOCK_RETURN_IF_ERROR(make_folder(socket.parent_path()));
  const fs::path lock_file = socket.string() + ".lock";
  UniqueFd file(
      ::open(lock_file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, S_IRUSR | S_IWUSR | S_IRGRP));
  if (!file) return os_error(lock_file, "open", "the daemon must be able to write to the socket's folder");
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    std::array<char, 32> holder{};
    const bool known = ::pread(file.get(), holder.data(), holder.size() - 1, 0) > 0;
    return Error{ErrorKind::refused,
                 fmt::format("another emberlockd{} serves here",
                             known ? fmt::format(" (pid {})", holder.data()) : std::string()),
                 socket.string(), "stop it, or choose another socket"};
  }
  const std::string pid = std::to_string(::getpid());
  if (::ftruncate(file.get(), 0) != 0 || ::pwrite(file.get(), pid.data(), pid.size(), 0) < 0)
    return os_error(lock_file, "write");
  EMBERLOCK_RETURN_IF_ERROR(remove_stale(socket));
  return SocketLock(std::move(file));
}

}  // namespace emberlock::rig
