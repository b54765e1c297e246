// SPDX-License-Identifier: Apache-2.0
#include "recon/export/error_words.h"

#include <fmt/format.h>

namespace emberlock::recon {
namespace {

// Shares of the error that noise alone makes: what would lower it.
constexpr double kHardlyNoise = 0.3, kMostlyNoise = 0.7;

std::string what_would_help(double share) {
  if (share < kHardlyNoise) return "more views or a better calibration would lower it, less noise hardly";
  if (share < kMostlyNoise) return "less noise would lower it, and so would more views";
  return "less noise would lower it: a longer exposure or more light";
}

}  // namespace

std::vector<std::string> error_words(const ErrorSummary& e) {
  const double percent = e.light > 0 ? 100 * e.emission / e.light : 0;
  std::string of_extinction;
  if (e.extinction > 0) of_extinction = fmt::format(", and the extinction to +-{:.2g} 1/m", e.extinction);
  std::vector<std::string> words = {fmt::format(
      "the light is known to +-{:.2g} % (one standard error, RMS where there is light){}: found by "
      "{} solves without some of the views{}, in {:.1f} s",
      percent, of_extinction, e.solves,
      e.models > 0
          ? fmt::format(" and {} with an extinction that explains the pictures nearly as well", e.models)
          : "",
      e.views_time.value())};
  if (!e.why_no_noise.empty()) words.push_back(e.why_no_noise);
  if (!e.noise) return words;
  const double share = e.emission > 0 ? e.noise->emission / e.emission : 0;
  words.push_back(
      fmt::format("the pictures' noise, {:.2g} grey levels, would alone make {:.2g} % of the light "
                  "uncertain, found by {} probes in {:.1f} s: {}",
                  e.noise->pixel, e.light > 0 ? 100 * e.noise->emission / e.light : 0, e.noise->probes,
                  e.noise->time.value(), what_would_help(share)));
  return words;
}

}  // namespace emberlock::recon
