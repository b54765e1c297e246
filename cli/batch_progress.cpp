// SPDX-License-Identifier: Apache-2.0
#include "cli/batch_progress.h"

#include <cmath>

#include <fmt/format.h>

#include "cli/batch_result.h"
#include "cli/commands.h"

namespace emberlock::cli {
namespace {

std::string words_of(Seconds time) {
  const auto seconds = static_cast<long long>(std::ceil(time.value()));
  if (seconds < 60) return fmt::format("{} s", seconds);
  if (seconds < 3600) return fmt::format("{} min {} s", seconds / 60, seconds % 60);
  return fmt::format("{} h {} min", seconds / 3600, seconds % 3600 / 60);
}

}  // namespace

std::string progress_words(std::size_t done, std::size_t frames, std::size_t since_begin, Seconds took) {
  std::string words = fmt::format("{} of {} frames", done, frames);
  if (since_begin == 0 || took.value() <= 0 || done >= frames) return words;
  const double rate = static_cast<double>(since_begin) / took.value();
  return fmt::format("{}, {:.2g} frames a second, {} left", words, rate,
                     words_of(Seconds(static_cast<double>(frames - done) / rate)));
}

BatchProgress::BatchProgress(const recon::Ledger& ledger, const recon::BatchPlan& plan)
    : ledger_(ledger),
      plan_(plan),
      bar_(progress_bar("batch")),
      begin_(clock_.now()),
      next_(begin_),
      before_(frames_done(ledger, plan)) {}

void BatchProgress::show() {
  const TimePoint now = clock_.now();
  if (now < next_) return;
  next_ = now + Seconds(1);
  const std::size_t done = frames_done(ledger_, plan_);
  const std::size_t since = done > before_ ? done - before_ : 0;  // a lost chunk's frames are gone again
  bar_(static_cast<double>(done) / static_cast<double>(plan_.frames.size()),
       progress_words(done, plan_.frames.size(), since, now - begin_));
}

}  // namespace emberlock::cli
