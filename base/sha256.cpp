// SPDX-License-Identifier: Apache-2.0
#include "base/sha256.h"

#include <algorithm>
#include <fstream>
#include <new>
#include <system_error>
#include <vector>

#include <openssl/evp.h>

#include "base/hex.h"
#include "base/kind_of_file.h"

namespace emberlock {
namespace {

EVP_MD_CTX* as_digest(void* context) { return static_cast<EVP_MD_CTX*>(context); }

Error unreadable(const std::filesystem::path& path, const char* what) {
  return {ErrorKind::io, what, path.string(), "Check that the file is there and readable"};
}

}  // namespace

void Sha256::Free::operator()(void* context) const { EVP_MD_CTX_free(as_digest(context)); }

Sha256::Sha256() : context_(EVP_MD_CTX_new()) {
  if (!context_ || EVP_DigestInit_ex(as_digest(context_.get()), EVP_sha256(), nullptr) != 1)
    throw std::bad_alloc();
}

void Sha256::add(std::string_view bytes) {
  EVP_DigestUpdate(as_digest(context_.get()), bytes.data(), bytes.size());
}

std::string Sha256::hex() {
  std::string digest(kSha256Digits / 2, '\0');
  EVP_DigestFinal_ex(as_digest(context_.get()), reinterpret_cast<unsigned char*>(digest.data()), nullptr);
  return to_hex(digest);
}

std::string sha256(std::string_view bytes) {
  Sha256 hash;
  hash.add(bytes);
  return hash.hex();
}

bool is_sha256(std::string_view text) { return is_hex(text, kSha256Digits); }

Result<FileHash> hash_file(const std::filesystem::path& path, const Observer& observer) {
  EMBERLOCK_RETURN_IF_ERROR(check_regular_file(path));
  std::error_code ec;
  const std::uintmax_t size = std::filesystem::file_size(path, ec);
  std::ifstream file(path, std::ios::binary);
  if (ec || !file) return unreadable(path, "can't be read");
  FileHash found;
  Sha256 hash;
  std::vector<char> block(1 << 20);
  while (file.read(block.data(), static_cast<std::streamsize>(block.size())), file.gcount() > 0) {
    hash.add({block.data(), static_cast<std::size_t>(file.gcount())});
    found.bytes += static_cast<std::uint64_t>(file.gcount());
    const double share = static_cast<double>(found.bytes) / static_cast<double>(std::max(size, found.bytes));
    EMBERLOCK_RETURN_IF_ERROR(observe(observer, share, path.filename().string()));
  }
  if (!file.eof()) return unreadable(path, "can't be read to its end");
  found.sha256 = hash.hex();
  return found;
}

}  // namespace emberlock
