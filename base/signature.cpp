// SPDX-License-Identifier: Apache-2.0
#include "base/signature.h"

#include <new>

#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>

#include "base/file.h"
#include "base/hex.h"
#include "base/secret_file.h"

namespace emberlock {
namespace {

constexpr std::size_t kLongestPem = std::size_t{64} << 10;

struct FreeEvp {
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
  void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
  void operator()(BIO* bio) const { BIO_free(bio); }
};
using Key = std::unique_ptr<EVP_PKEY, FreeEvp>;
using Signing = std::unique_ptr<EVP_MD_CTX, FreeEvp>;

const unsigned char* bytes_of(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

/// A key that has a password isn't asked for it: that would wait for a terminal.
int no_password(char* /*buffer*/, int /*size*/, int /*writing*/, void* /*user*/) { return -1; }

Result<std::shared_ptr<EVP_PKEY>> read_pem(const std::filesystem::path& path,
                                           decltype(&PEM_read_bio_PUBKEY) read, const char* what) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(path, kLongestPem));
  const std::unique_ptr<BIO, FreeEvp> bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
  if (!bio) throw std::bad_alloc();
  std::shared_ptr<EVP_PKEY> key(read(bio.get(), nullptr, no_password, nullptr), FreeEvp());
  ERR_clear_error();
  if (key && EVP_PKEY_get_base_id(key.get()) == EVP_PKEY_ED25519) return key;
  return Error{
      ErrorKind::bad_input, std::string("is not ") + what, path.string(),
      "Make one, without a password: openssl genpkey -algorithm ed25519 -out key.pem; openssl pkey -in "
      "key.pem -pubout -out public.pem"};
}

std::string public_digits(const EVP_PKEY* key) {
  std::string raw(kPublicKeyDigits / 2, '\0');
  std::size_t size = raw.size();
  if (EVP_PKEY_get_raw_public_key(key, reinterpret_cast<unsigned char*>(raw.data()), &size) != 1)
    throw std::bad_alloc();
  return to_hex(raw);
}

}  // namespace

Result<SigningKey> SigningKey::read(const std::filesystem::path& pem) {
  EMBERLOCK_ASSIGN_OR_RETURN(std::shared_ptr<EVP_PKEY> key,
                             read_pem(pem, PEM_read_bio_PrivateKey, "a private Ed25519 key in PEM"));
  EMBERLOCK_RETURN_IF_ERROR(check_secret_file(pem, "the key"));
  std::string digits = public_digits(key.get());
  return SigningKey(std::move(key), std::move(digits));
}

std::string SigningKey::sign(std::string_view text) const {
  const Signing context(EVP_MD_CTX_new());
  std::string signature(kSignatureDigits / 2, '\0');
  std::size_t size = signature.size();
  if (!context ||
      EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, static_cast<EVP_PKEY*>(key_.get())) != 1 ||
      EVP_DigestSign(context.get(), reinterpret_cast<unsigned char*>(signature.data()), &size, bytes_of(text),
                     text.size()) != 1)
    throw std::bad_alloc();  // OpenSSL gives no other reason for a key that it has read
  return to_hex(signature);
}

Result<std::string> read_public_key(const std::filesystem::path& pem) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::shared_ptr<EVP_PKEY> key,
                             read_pem(pem, PEM_read_bio_PUBKEY, "a public Ed25519 key in PEM"));
  return public_digits(key.get());
}

bool is_signed_by(std::string_view public_key, std::string_view text, std::string_view signature) {
  if (!is_hex(public_key, kPublicKeyDigits) || !is_hex(signature, kSignatureDigits)) return false;
  const std::string raw = from_hex(public_key);
  const std::string bits = from_hex(signature);
  const Key key(EVP_PKEY_new_raw_public_key(EVP_PKEY_ED25519, nullptr, bytes_of(raw), raw.size()));
  const Signing context(EVP_MD_CTX_new());
  const bool good =
      key && context && EVP_DigestVerifyInit(context.get(), nullptr, nullptr, nullptr, key.get()) == 1 &&
      EVP_DigestVerify(context.get(), bytes_of(bits), bits.size(), bytes_of(text), text.size()) == 1;
  ERR_clear_error();
  return good;
}

}  // namespace emberlock
