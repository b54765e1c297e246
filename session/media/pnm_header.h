// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

namespace emberlock::session {

/// The header of a binary PGM or PPM: numbers between white space and comments (netpbm's format definition).
class PnmHeader {
 public:
  explicit PnmHeader(std::string_view s) : s_(s) {}
  std::optional<std::int64_t> number() {
    skip_space();
    std::int64_t v = 0;
    const std::size_t first = at_;
    for (; at_ < s_.size() && std::isdigit(static_cast<unsigned char>(s_[at_])) != 0; ++at_) {
      v = std::min<std::int64_t>(v * 10 + (s_[at_] - '0'), std::numeric_limits<std::int32_t>::max());
    }
    if (at_ == first) return std::nullopt;
    return v;
  }
  /// A single white space ends the header; the samples follow.
  [[nodiscard]] std::string_view samples() const { return s_.substr(std::min(at_ + 1, s_.size())); }

 private:
  void skip_space() {
    while (at_ < s_.size() && (std::isspace(static_cast<unsigned char>(s_[at_])) != 0 || s_[at_] == '#')) {
      if (s_[at_] == '#') at_ = std::min(s_.find('\n', at_), s_.size() - 1);
      ++at_;
    }
  }
  std::string_view s_;
  std::size_t at_ = 2;
};

/// Bytes of the binary PGM or PPM with which `s` begins; nullopt for other kinds and damaged headers.
inline std::optional<std::size_t> pnm_size(std::string_view s) {
  if (s.size() < 2 || (s[1] != '5' && s[1] != '6')) return {};
  PnmHeader header(s);
  const auto width = header.number();
  const auto height = header.number();
  const auto maxval = header.number();
  if (!width || !height || !maxval) return {};
  const std::int64_t row = *width * (s[1] == '6' ? 3 : 1) * (*maxval > 255 ? 2 : 1);
  if (row > 0 && *height > std::numeric_limits<std::int64_t>::max() / row) return {};
  return s.size() - header.samples().size() + static_cast<std::size_t>(row * *height);
}

}  // namespace emberlock::session
