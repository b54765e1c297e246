// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <string>

#include <fmt/format.h>

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
                 "give a positive number with its unit: 0.5ms, 500us or 10rows"};
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

Tolerance tolerance_for(const FlameMotion& flame) {
  constexpr double kPartOfDetail = 0.25;
  return {Seconds(kPartOfDetail * flame.detail.value() / flame.speed.value())};
}

std::string words(const Tolerance& tolerance, SecondsPerRow row_time) {
  const double ms = in_milliseconds(tolerance.in_time(row_time));
  const double rows = tolerance.in_rows(row_time).value();
  return fmt::format("{:.{}f} ms ({:.{}f} rows)", ms,
                     ms < 0.1 ? 4
                     : ms < 1 ? 3
                              : 2,
                     rows, rows < 100 ? 1 : 0);
}

std::string_view name(AlignPolicy policy) { return kPolicyNames.second_of(policy).value_or("unknown"); }

Result<AlignPolicy> parse_align_policy(std::string_view text) {
  if (const auto policy = kPolicyNames.first_of(text)) return *policy;
  return Error{ErrorKind::bad_input, "is no policy", "policy '" + std::string(text) + "'",
               "use fixed-reference, densest, timed or trimmed"};
}

}  // namespace emberlock::smear
