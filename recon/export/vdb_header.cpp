// SPDX-License-Identifier: Apache-2.0
#include "recon/export/vdb_header.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "recon/export/vdb_bytes.h"

namespace emberlock::recon {
namespace {

constexpr std::uint32_t kLongestName = 1024;
constexpr std::uint32_t kLongestText = std::uint32_t{64} << 20;
constexpr std::uint32_t kMostMetadata = 4096;

Error bad_header(std::string what, const std::string& where) {
  return {ErrorKind::bad_input, std::move(what), where,
          "Name a volume.vdb that `emberlock reconstruct` wrote"};
}

}  // namespace

Result<std::optional<VdbText>> find_vdb_text(std::istream& file, std::string_view key,
                                             const std::string& where) {
  VdbBytes header(file);
  std::array<char, kVdbMagic.size()> magic{};
  std::copy(kVdbMagic.begin(), kVdbMagic.end(), magic.begin());
  if (header.number<std::array<char, 8>>() != magic) return bad_header("isn't an OpenVDB file", where);
  header.go_to(kVdbFirstMetadatum);
  const auto count = header.number<std::uint32_t>();
  if (!count) return bad_header("is cut short in its header", where);
  if (*count > kMostMetadata) return bad_header("has a damaged header", where);
  std::optional<VdbText> found;
  for (std::uint32_t i = 0; i < *count; ++i) {
    const auto name = header.text(kLongestName);
    const auto type = header.text(kLongestName);
    if (!name || !type) return bad_header("is cut short in its header, or that is damaged", where);
    if (*name != key) {
      if (!header.pass()) return bad_header("is cut short in its header, or that is damaged", where);
      continue;
    }
    if (found) return bad_header("has " + *name + " twice", where);
    if (*type != "string") return bad_header("has a damaged " + *name, where);
    const std::uint64_t place = header.at() + sizeof(std::uint32_t);
    auto text = header.text(kLongestText);
    if (!text) return bad_header("is cut short in its " + *name, where);
    found = VdbText{place, std::move(*text)};
  }
  return found;
}

}  // namespace emberlock::recon
