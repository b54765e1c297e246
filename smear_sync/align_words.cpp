#include "smear_sync/align_words.h"

#include <cmath>

namespace emberlock {

std::string standing(Seconds error, SecondsPerRow row_time) {
  return format("reads %.1f rows (%.3f ms) %s the target", std::abs((error / row_time).value()),
                std::abs(in_milliseconds(error)), error.value() >= 0 ? "before" : "after");
}

std::string plural(std::size_t count, const std::string& one) {
  return std::to_string(count) + " " + one + (count == 1 ? "" : "s");
}

std::string words(Seconds time) {
  const double s = time.value();
  if (s < 100) return format("%.*f s", s < 10 ? 1 : 0, s);
  if (s < 6000) return format("%.1f min", s / 60);
  return format("%.1f h", s / 3600);
}

std::string words(const AlignEffort& effort) {
  return format("%.0f resets (95 %%: %d) and ", effort.resets, effort.resets_p95) + words(effort.time) +
         " (95 %: " + words(effort.time_p95) + ")";
}

std::string refusal(const AlignEffort& effort, const std::vector<AlignOffer>& offers,
                    const AlignOptions& options) {
  const AlignLimits limits = options.limits.value_or(AlignLimits{});
  const double rows = options.tolerance.in_rows(options.row_time).value();
  std::string text =
      format("%.1f rows by %s are met with a probability of %.0f %% within %d resets and ", rows,
             std::string(name(options.policy)).c_str(), 100 * effort.within, limits.resets) +
      words(limits.time) + format(", and %.0f %% are asked for", 100 * limits.probability);
  if (offers.empty()) return text + "; allow more resets or time";
  text += ". What could be met: ";
  for (std::size_t i = 0; i < offers.size(); ++i) {
    const AlignOffer& offer = offers[i];
    text += (i == 0 ? "" : "; ") +
            format("%.1f rows by %s with ", offer.tolerance.in_rows(options.row_time).value(),
                   std::string(name(offer.policy)).c_str()) +
            words(offer.effort) + format(", at %.0f %%", 100 * offer.effort.within);
  }
  return text;
}

TrackOptions track_options(const AlignOptions& options) {
  return {.period = options.period, .rate_spread = options.rate_spread, .rate_wander = options.rate_wander};
}

std::string_view name(AlignPolicy policy) {
  switch (policy) {
    case AlignPolicy::fixed_reference:
      return "fixed-reference";
    case AlignPolicy::densest:
      return "densest";
    case AlignPolicy::timed:
      return "timed";
    case AlignPolicy::trimmed:
      return "trimmed";
  }
  return "unknown";
}

std::string_view name(AlignVerdict verdict) {
  switch (verdict) {
    case AlignVerdict::go_on:
      return "go-on";
    case AlignVerdict::aligned:
      return "aligned";
    case AlignVerdict::refused:
      return "refused";
    case AlignVerdict::given_up:
      return "given-up";
  }
  return "unknown";
}

}  // namespace emberlock
