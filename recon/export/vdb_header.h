// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <istream>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock::recon {

inline constexpr std::string_view kVdbMagic{" BDV\0\0\0\0", 8};
/// Behind magic, versions, whether there are offsets, and the identifier.
inline constexpr std::uint64_t kVdbFirstMetadatum = 8 + 3 * 4 + 1 + 36;

/// A text of a file's metadata, and where its first byte stands.
struct VdbText {
  std::uint64_t offset = 0;
  std::string text;
};

/// The metadatum `key`, of type string, of an OpenVDB file's header (io/Archive.cc, readHeader() and
/// MetaMap::readMeta()): of the file, not of a grid. The bytes may be anybody's: none of their sizes is
/// trusted, and nothing but the text is kept. Nothing where there is no such metadatum. Errors (bad_input):
/// no OpenVDB file; the metadatum is there twice, cut short, of another type or above 64 MiB.
Result<std::optional<VdbText>> find_vdb_text(std::istream& file, std::string_view key,
                                             const std::string& where);

}  // namespace emberlock::recon
