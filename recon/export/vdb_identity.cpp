// SPDX-License-Identifier: Apache-2.0
#include "recon/export/vdb_identity.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "base/random.h"

namespace emberlock::recon {
namespace {

// Magic number, versions of the file and the library, whether grids have offsets; then the identifier.
constexpr std::size_t kBefore = 21;
constexpr std::size_t kIdentifier = 36;

/// Two words that follow from the bytes and their order.
class ContentHash {
 public:
  void add(std::string_view bytes) {
    for (std::size_t i = 0; i < bytes.size(); i += sizeof(std::uint64_t)) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes.data() + i, std::min(sizeof word, bytes.size() - i));
      first_ = mix64(first_ ^ word);
      second_ = mix64(second_ + word);
    }
  }
  /// As RFC 9562 writes one whose bits were made elsewhere (version 8).
  [[nodiscard]] std::string as_uuid() const {
    return fmt::format("{:08x}-{:04x}-8{:03x}-{:04x}-{:012x}", first_ >> 32, first_ >> 16 & 0xffff,
                       first_ & 0xfff, (second_ >> 48 & 0x3fff) | 0x8000, second_ & 0xffffffffffff);
  }

 private:
  std::uint64_t first_ = 1, second_ = 2;
};

}  // namespace

void identify_by_content(const std::filesystem::path& vdb) {
  std::fstream file(vdb, std::ios::binary | std::ios::in | std::ios::out);
  file.exceptions(std::ios::failbit | std::ios::badbit);
  file.seekg(0, std::ios::end);
  std::size_t left = static_cast<std::size_t>(file.tellg()) - kBefore - kIdentifier;
  file.seekg(kBefore + kIdentifier);
  ContentHash hash;
  std::vector<char> block(1 << 20);
  while (left > 0) {
    const std::size_t count = std::min(left, block.size());
    file.read(block.data(), static_cast<std::streamsize>(count));
    hash.add({block.data(), count});
    left -= count;
  }
  file.seekp(kBefore);
  file << hash.as_uuid();
  file.close();
}

}  // namespace emberlock::recon
