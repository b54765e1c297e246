// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace emberlock::daemon {

/// Bytes of a file: `length` from `first` on.
struct ByteRange {
  std::uint64_t first = 0;
  std::uint64_t length = 0;
  friend bool operator==(const ByteRange&, const ByteRange&) = default;
};

/// What a Range header asks for (RFC 9110, 14.2).
struct RangeRequest {
  enum class Kind {
    whole,          ///< no range, or one that the RFC has ignored: another unit, several ranges, bad syntax
    part,           ///< `range`
    unsatisfiable,  ///< it begins behind the end
  };
  Kind kind = Kind::whole;
  ByteRange range = {};
};

/// The bytes that "bytes=FIRST-LAST", "bytes=FIRST-" or "bytes=-COUNT" means in a file of `size` bytes.
RangeRequest parse_range(std::string_view header, std::uint64_t size);

}  // namespace emberlock::daemon
