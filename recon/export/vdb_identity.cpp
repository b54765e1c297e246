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

/// The identifier that follows from what is behind it. Throws std::ios::failure.
std::string identifier_of(std::istream& file) {
  file.seekg(0, std::ios::end);
  std::streamoff left = static_cast<std::streamoff>(file.tellg()) - std::streamoff{kBefore + kIdentifier};
  file.seekg(kBefore + kIdentifier);
  ContentHash hash;
  std::vector<char> block(1 << 20);
  while (left > 0) {
    const auto count = std::min(left, static_cast<std::streamoff>(block.size()));
    file.read(block.data(), count);
    hash.add({block.data(), static_cast<std::size_t>(count)});
    left -= count;
  }
  return hash.as_uuid();
}

}  // namespace

void identify_by_content(const std::filesystem::path& vdb) {
  std::fstream file(vdb, std::ios::binary | std::ios::in | std::ios::out);
  file.exceptions(std::ios::failbit | std::ios::badbit);
  const std::string identifier = identifier_of(file);
  file.seekp(kBefore);
  file << identifier;
  file.close();
}

bool is_identified_by_content(const std::filesystem::path& vdb) try {
  std::ifstream file(vdb, std::ios::binary);
  file.exceptions(std::ios::failbit | std::ios::badbit);
  const std::string expected = identifier_of(file);
  std::string there(kIdentifier, '\0');
  file.seekg(kBefore);
  file.read(there.data(), static_cast<std::streamsize>(there.size()));
  return there == expected;
} catch (const std::ios::failure&) {
  return false;
}

}  // namespace emberlock::recon
