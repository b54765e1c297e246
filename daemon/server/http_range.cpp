// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/http_range.h"

#include <algorithm>
#include <charconv>

namespace emberlock::daemon {
namespace {

std::optional<std::uint64_t> parse_position(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

RangeRequest parse_range(std::string_view header, std::uint64_t size) {
  using Kind = RangeRequest::Kind;
  constexpr std::string_view kUnit = "bytes=";
  const std::size_t hyphen = header.find('-');
  if (!header.starts_with(kUnit) || hyphen == std::string_view::npos) return {};
  const std::string_view from = header.substr(kUnit.size(), hyphen - kUnit.size());
  const std::string_view to = header.substr(hyphen + 1);
  const auto first = parse_position(from);
  const auto last = parse_position(to);
  if ((!from.empty() && !first) || (!to.empty() && !last) || (!first && !last)) return {};
  if (!first) {
    const std::uint64_t length = std::min(*last, size);
    return length == 0 ? RangeRequest{Kind::unsatisfiable}
                       : RangeRequest{Kind::part, {size - length, length}};
  }
  if (last && *last < *first) return {};
  if (*first >= size) return {Kind::unsatisfiable};
  return {Kind::part, {*first, std::min(last.value_or(size - 1), size - 1) - *first + 1}};
}

}  // namespace emberlock::daemon
