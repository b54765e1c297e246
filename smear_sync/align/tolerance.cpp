// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <string>

#include "base/one_to_one.h"
#include "smear_sync/align/align.h"

namespace emberlock::smear {
namespace {

constexpr OneToOne<AlignPolicy, std::string_view, 4> kPolicyNames{
    {{{AlignPolicy::fixed_reference, "fixed-reference"},
      {AlignPolicy::densest, "densest"},
      {AlignPolicy::timed, "timed"},
      {AlignPolicy::trimmed, "trimmed"}}}};

}  // namespace

Seconds Tolerance::in_time(SecondsPerRow row_time) const {
  if (const auto* rows = std::get_if<Rows>(&amount)) return *rows * row_time;
  return std::get<Seconds>(amount);
}

Rows Tolerance::in_rows(SecondsPerRow row_time) const {
  if (const auto* rows = std::get_if<Rows>(&amount)) return *rows;
  return std::get<Seconds>(amount) / row_time;
}

Result<Tolerance> parse_tolerance(std::string_view text) {
  const auto refuse = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, what, "tolerance '" + std::string(text) + "'",
                 "give a positive number with its unit: 100rows, 5.4ms or 500us"};
  };
  double amount = 0;
  const auto [rest, code] = std::from_chars(text.data(), text.data() + text.size(), amount);
  if (code != std::errc()) return refuse("doesn't begin with a number");
  if (!std::isfinite(amount) || amount <= 0) return refuse("must be positive");
  const std::string_view unit(rest, static_cast<std::size_t>(text.data() + text.size() - rest));
  if (unit == "rows" || unit == "row") return Tolerance{Rows(amount)};
  if (unit == "ms") return Tolerance{milliseconds(amount)};
  if (unit == "us") return Tolerance{microseconds(amount)};
  return refuse(unit.empty() ? "has no unit" : "has an unknown unit '" + std::string(unit) + "'");
}

std::string_view name(AlignPolicy policy) { return kPolicyNames.second_of(policy).value_or("unknown"); }

Result<AlignPolicy> parse_align_policy(std::string_view text) {
  if (const auto policy = kPolicyNames.first_of(text)) return *policy;
  return Error{ErrorKind::bad_input, "is no policy", "policy '" + std::string(text) + "'",
               "use fixed-reference, densest, timed or trimmed"};
}

}  // namespace emberlock::smear
