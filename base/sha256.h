// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "base/progress.h"
#include "base/result.h"

namespace emberlock {

/// SHA-256 (FIPS 180-4) of bytes that come in parts.
class Sha256 {
 public:
  Sha256();
  void add(std::string_view bytes);
  /// Its 64 lower-case hexadecimal digits. Ends this object.
  [[nodiscard]] std::string hex();

 private:
  struct Free {
    void operator()(void* context) const;
  };
  std::unique_ptr<void, Free> context_;
};

inline constexpr std::size_t kSha256Digits = 64;
std::string sha256(std::string_view bytes);
/// Whether `text` is 64 lower-case hexadecimal digits.
bool is_sha256(std::string_view text);

struct FileHash {
  std::uint64_t bytes = 0;
  std::string sha256;
};
/// Of a file as it is now, read once, in blocks. `observer` is told the share that is read. Errors: io;
/// refused, where the observer ends it.
Result<FileHash> hash_file(const std::filesystem::path& path, const Observer& observer = {});

}  // namespace emberlock
