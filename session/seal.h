// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/progress.h"
#include "base/result.h"
#include "base/signature.h"

// A seal is a text of fixed length within a file that tells the SHA-256 of the whole file:
//   emberlock-seal-1 sha256:64 digits key:64 digits signature:128 digits
// The hash is taken with the digits of hash and signature as 0, so it covers the key too. The signature
// (Ed25519) is of the purpose, a space and the hash. Without a key, key and signature stay 0.
namespace emberlock::session {

inline constexpr std::size_t kSealLength = 296;

struct Seal {
  std::string sha256;
  std::string key;        ///< the public one; empty: unsigned
  std::string signature;  ///< empty: unsigned
};

/// What of a file is sealed, so that a signature for one kind holds for no other.
inline constexpr std::string_view kSealsVolume = "emberlock volume";
inline constexpr std::string_view kSealsSession = "emberlock session";

/// The text to be written where the seal will be. `key` null: unsigned.
std::string blank_seal(const SigningKey* key);
/// Errors (bad_input): not of this form, or of another version; `where` is named.
Result<Seal> parse_seal(std::string_view text, const std::string& where);
/// A certificate's text ends in its seal: where that begins. Error: bad_input.
Result<std::size_t> place_of_seal(std::string_view certificate, const std::string& where);

/// A text that has blank_seal(key) at `place`, sealed.
std::string sealed(std::string text, std::size_t place, const SigningKey* key, std::string_view purpose);
/// Seals a file that has blank_seal(key) at `offset`. Errors: io; bad_input, where there is none.
Status seal_file(const std::filesystem::path& path, std::uint64_t offset, const SigningKey* key,
                 std::string_view purpose);
/// The seal at `offset`, if it is that of all the file's bytes. Error (refused): it isn't: a byte was
/// changed, or the signature isn't by its key. Errors: io, bad_input (no seal there).
Result<Seal> check_seal(const std::filesystem::path& path, std::uint64_t offset, std::string_view purpose,
                        const Observer& observer = {});
/// Error (refused): not signed, or by another key.
Status check_signer(const Seal& seal, std::string_view public_key, const std::string& where);

}  // namespace emberlock::session
