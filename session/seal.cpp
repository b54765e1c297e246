// SPDX-License-Identifier: Apache-2.0
#include "session/seal.h"

#include <algorithm>
#include <fstream>
#include <vector>

#include "base/hex.h"
#include "base/kind_of_file.h"
#include "base/sha256.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kSealForm = "emberlock-seal-";
constexpr std::string_view kSealVersion = "emberlock-seal-1 sha256:";
constexpr std::string_view kBeforeKey = " key:";
constexpr std::string_view kBeforeSignature = " signature:";
constexpr std::size_t kHashPlace = kSealVersion.size();
constexpr std::size_t kKeyPlace = kHashPlace + kSha256Digits + kBeforeKey.size();
constexpr std::size_t kSignaturePlace = kKeyPlace + kPublicKeyDigits + kBeforeSignature.size();
static_assert(kSealLength == kSignaturePlace + kSignatureDigits);

/// What stands around a seal at the end of a certificate, as protobuf's JSON has it.
constexpr std::string_view kBeforeSeal = "\"seal\": \"";
constexpr std::string_view kBehindSeal = "\"\n}\n";

bool all_zero(std::string_view digits) { return digits.find_first_not_of('0') == std::string_view::npos; }

Error no_seal(std::string what, const std::string& where) {
  return {ErrorKind::bad_input, std::move(what), where, "Take the file as Emberlock wrote it"};
}

Result<std::string> seal_text_at(const fs::path& path, std::uint64_t offset) {
  EMBERLOCK_RETURN_IF_ERROR(check_regular_file(path));
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorKind::io, "can't be read", path.string()};
  std::string text(kSealLength, '\0');
  file.seekg(static_cast<std::streamoff>(offset));
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file) return no_seal("is cut short in its certificate's seal", path.string());
  return text;
}

/// Writes 0 over what of `count` bytes of the file from `at` on is in the block, which begins at `block_at`.
void blank(std::vector<char>& block, std::uint64_t block_at, std::uint64_t at, std::uint64_t count) {
  const std::uint64_t begin = std::max(at, block_at);
  const std::uint64_t end = std::min(at + count, block_at + block.size());
  if (begin < end)
    std::fill(block.begin() + static_cast<std::ptrdiff_t>(begin - block_at),
              block.begin() + static_cast<std::ptrdiff_t>(end - block_at), '0');
}

/// Of all bytes, those of the seal's hash and signature as 0.
Result<std::string> hash_around(const fs::path& path, std::uint64_t offset, const Observer& observer) {
  std::error_code ec;
  const double size = std::max(1.0, static_cast<double>(fs::file_size(path, ec)));
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorKind::io, "can't be read", path.string()};
  Sha256 hash;
  constexpr std::size_t kBlock = 1 << 20;
  std::vector<char> block(kBlock);
  for (std::uint64_t at = 0; block.size() == kBlock; at += block.size()) {
    file.read(block.data(), static_cast<std::streamsize>(kBlock));
    block.resize(static_cast<std::size_t>(file.gcount()));
    blank(block, at, offset + kHashPlace, kSha256Digits);
    blank(block, at, offset + kSignaturePlace, kSignatureDigits);
    hash.add({block.data(), block.size()});
    const double share = std::min(1.0, static_cast<double>(at) / size);
    EMBERLOCK_RETURN_IF_ERROR(observe(observer, share, path.filename().string()));
  }
  if (!file.eof()) return Error{ErrorKind::io, "can't be read to its end", path.string()};
  return hash.hex();
}

std::string signed_text(std::string_view purpose, const std::string& hash) {
  return std::string(purpose) + ' ' + hash;
}

}  // namespace

std::string blank_seal(const SigningKey* key) {
  std::string text(kSealVersion);
  text.append(kSha256Digits, '0').append(kBeforeKey);
  text += key != nullptr ? key->public_key() : std::string(kPublicKeyDigits, '0');
  return text.append(kBeforeSignature).append(kSignatureDigits, '0');
}

Result<Seal> parse_seal(std::string_view text, const std::string& where) {
  if (text.starts_with(kSealForm) && !text.starts_with(kSealVersion))
    return no_seal("has a seal of another version than 1: a newer Emberlock reads it", where);
  const bool formed =
      text.size() == kSealLength && text.starts_with(kSealVersion) &&
      text.substr(kKeyPlace - kBeforeKey.size(), kBeforeKey.size()) == kBeforeKey &&
      text.substr(kSignaturePlace - kBeforeSignature.size(), kBeforeSignature.size()) == kBeforeSignature;
  if (!formed) return no_seal("has no seal where its certificate ends", where);
  Seal seal{std::string(text.substr(kHashPlace, kSha256Digits)),
            std::string(text.substr(kKeyPlace, kPublicKeyDigits)),
            std::string(text.substr(kSignaturePlace, kSignatureDigits))};
  if (!is_sha256(seal.sha256) || !is_hex(seal.key, kPublicKeyDigits) ||
      !is_hex(seal.signature, kSignatureDigits))
    return no_seal("has a seal with something else than hexadecimal digits", where);
  if (!all_zero(seal.key)) return seal;
  // As a key, 0 is a point of order 4, of which one can sign without any private key.
  if (!all_zero(seal.signature)) return no_seal("has a signature without a key", where);
  seal.key = seal.signature = "";
  return seal;
}

Result<std::size_t> place_of_seal(std::string_view certificate, const std::string& where) {
  constexpr std::size_t kTail = kBeforeSeal.size() + kSealLength + kBehindSeal.size();
  if (certificate.size() < kTail || !certificate.ends_with(kBehindSeal) ||
      certificate.substr(certificate.size() - kTail, kBeforeSeal.size()) != kBeforeSeal)
    return no_seal("has a certificate that doesn't end in its seal: it is cut off, or changed", where);
  return certificate.size() - kTail + kBeforeSeal.size();
}

std::string sealed(std::string text, std::size_t place, const SigningKey* key, std::string_view purpose) {
  const std::string hash = sha256(text);
  text.replace(place + kHashPlace, kSha256Digits, hash);
  if (key != nullptr)
    text.replace(place + kSignaturePlace, kSignatureDigits, key->sign(signed_text(purpose, hash)));
  return text;
}

Status seal_file(const fs::path& path, std::uint64_t offset, const SigningKey* key,
                 std::string_view purpose) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, seal_text_at(path, offset));
  if (text != blank_seal(key)) return no_seal("has no blank seal", path.string());
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string hash, hash_around(path, offset, {}));
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(static_cast<std::streamoff>(offset + kHashPlace));
  file << hash;
  file.seekp(static_cast<std::streamoff>(offset + kSignaturePlace));
  if (key != nullptr) file << key->sign(signed_text(purpose, hash));
  file.close();
  if (file) return {};
  return Error{ErrorKind::io, "can't be sealed", path.string(),
               "Check that the folder is writable and the disk has room"};
}

Result<Seal> check_seal(const fs::path& path, std::uint64_t offset, std::string_view purpose,
                        const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, seal_text_at(path, offset));
  EMBERLOCK_ASSIGN_OR_RETURN(Seal seal, parse_seal(text, path.string()));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string hash, hash_around(path, offset, observer));
  const char* const remedy = "Take the file as it was certified, from a copy";
  if (hash != seal.sha256)
    return Error{ErrorKind::refused, "isn't what its certificate seals: its bytes were changed",
                 path.string(), remedy};
  if (!seal.key.empty() && !is_signed_by(seal.key, signed_text(purpose, hash), seal.signature))
    return Error{ErrorKind::refused, "has a signature that isn't by the key that it names", path.string(),
                 remedy};
  return seal;
}

Status check_signer(const Seal& seal, std::string_view public_key, const std::string& where) {
  if (seal.key == public_key) return {};
  return Error{ErrorKind::refused,
               seal.key.empty() ? "isn't signed" : "is signed by another key: " + seal.key, where,
               "Ask its maker for a file signed by the key that you trust"};
}

}  // namespace emberlock::session
