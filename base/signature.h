// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "base/result.h"

// Ed25519 signatures (RFC 8032). Keys are PEM files as OpenSSL writes them:
//   openssl genpkey -algorithm ed25519 -out key.pem; openssl pkey -in key.pem -pubout -out public.pem
namespace emberlock {

inline constexpr std::size_t kPublicKeyDigits = 64;
inline constexpr std::size_t kSignatureDigits = 128;

class SigningKey {
 public:
  /// Errors (bad_input): no PEM, one with a password, another kind of key, one that others may read or
  /// replace.
  static Result<SigningKey> read(const std::filesystem::path& pem);

  /// 64 lower-case hexadecimal digits.
  [[nodiscard]] const std::string& public_key() const { return public_key_; }
  /// 128 of them: the same for the same text.
  [[nodiscard]] std::string sign(std::string_view text) const;

 private:
  SigningKey(std::shared_ptr<void> key, std::string public_key)
      : key_(std::move(key)), public_key_(std::move(public_key)) {}
  std::shared_ptr<void> key_;
  std::string public_key_;
};

/// A public key's file as 64 hexadecimal digits. Errors (bad_input): no PEM, another kind of key.
Result<std::string> read_public_key(const std::filesystem::path& pem);

/// Whether whoever holds the private key of `public_key` signed the text. Both are hexadecimal digits.
bool is_signed_by(std::string_view public_key, std::string_view text, std::string_view signature);

}  // namespace emberlock
