// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include <openssl/evp.h>
#include <openssl/pem.h>

namespace emberlock::test {

/// Writes an Ed25519 key as OpenSSL does: FOLDER/private.pem and FOLDER/public.pem, always the same ones of a
/// seed (RFC 8032, 5.1.5).
struct KeyFiles {
  std::filesystem::path private_pem, public_pem;

  KeyFiles(const std::filesystem::path& folder, const std::array<unsigned char, 32>& seed)
      : private_pem(folder / "private.pem"), public_pem(folder / "public.pem") {
    std::filesystem::create_directories(folder);
    const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(
        EVP_PKEY_new_raw_private_key(EVP_PKEY_ED25519, nullptr, seed.data(), seed.size()), EVP_PKEY_free);
    const auto write = [&](const std::filesystem::path& path, auto&& put) {
      const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "w"), std::fclose);
      if (!file || put(file.get()) != 1) throw std::runtime_error("no key");
    };
    write(private_pem, [&](std::FILE* file) {
      return PEM_write_PrivateKey(file, key.get(), nullptr, nullptr, 0, nullptr, nullptr);
    });
    std::filesystem::permissions(private_pem,
                                 std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    write(public_pem, [&](std::FILE* file) { return PEM_write_PUBKEY(file, key.get()); });
  }
  KeyFiles(const std::filesystem::path& folder, unsigned char seed) : KeyFiles(folder, filled(seed)) {}

 private:
  static std::array<unsigned char, 32> filled(unsigned char byte) {
    std::array<unsigned char, 32> seed{};
    seed.fill(byte);
    return seed;
  }
};

}  // namespace emberlock::test
