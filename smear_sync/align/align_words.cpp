// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align_words.h"

#include <cmath>

#include <fmt/format.h>

#include "base/one_to_one.h"

namespace emberlock::smear {
namespace {

constexpr OneToOne<AlignVerdict, std::string_view, 4> kVerdictNames{{{{AlignVerdict::go_on, "go-on"},
                                                                      {AlignVerdict::aligned, "aligned"},
                                                                      {AlignVerdict::refused, "refused"},
                                                                      {AlignVerdict::given_up, "given-up"}}}};

}  // namespace

std::string standing(Seconds error, SecondsPerRow row_time) {
  return fmt::format("reads {:.1f} rows ({:.3f} ms) {} the target", std::abs((error / row_time).value()),
                     std::abs(in_milliseconds(error)), error.value() >= 0 ? "before" : "after");
}

std::string plural(std::size_t count, const std::string& one) {
  return std::to_string(count) + " " + one + (count == 1 ? "" : "s");
}

std::string words(Seconds time) {
  const double s = time.value();
  if (s < 100) return fmt::format("{:.{}f} s", s, s < 10 ? 1 : 0);
  if (s < 6000) return fmt::format("{:.1f} min", s / 60);
  return fmt::format("{:.1f} h", s / 3600);
}

std::string words(const AlignEffort& effort) {
  return fmt::format("{:.0f} resets (95 %: {}) and ", effort.resets, effort.resets_p95) + words(effort.time) +
         " (95 %: " + words(effort.time_p95) + ")";
}

std::string refusal(const AlignEffort& effort, const std::vector<AlignOffer>& offers,
                    const AlignOptions& options) {
  const AlignLimits limits = options.limits.value_or(AlignLimits{});
  const double rows = options.tolerance.in_rows(options.row_time).value();
  std::string text =
      fmt::format("{:.1f} rows by {} are met with a probability of {:.0f} % within {} resets and ", rows,
                  name(options.policy), 100 * effort.within, limits.resets) +
      words(limits.time) + fmt::format(", and {:.0f} % are asked for", 100 * limits.probability);
  if (offers.empty()) return text + "; allow more resets or time";
  text += ". What could be met: ";
  for (std::size_t i = 0; i < offers.size(); ++i) {
    const AlignOffer& offer = offers[i];
    text += (i == 0 ? "" : "; ") +
            fmt::format("{:.1f} rows by {} with ", offer.tolerance.in_rows(options.row_time).value(),
                        name(offer.policy)) +
            words(offer.effort) + fmt::format(", at {:.0f} %", 100 * offer.effort.within);
  }
  return text;
}

TrackOptions track_options(const AlignOptions& options) {
  return {.period = options.period, .rate_spread = options.rate_spread, .rate_wander = options.rate_wander};
}

std::string_view name(AlignVerdict verdict) { return kVerdictNames.second_of(verdict).value_or("unknown"); }

}  // namespace emberlock::smear
