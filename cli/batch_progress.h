// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "base/clock.h"
#include "base/progress.h"
#include "recon/batch/ledger.h"
#include "recon/batch/plan.h"

namespace emberlock::cli {

/// How far a batch is, of all ranks together, on the terminal of one: frames and the time left, at the rate
/// since it began to look.
class BatchProgress {
 public:
  /// Both must outlive it.
  BatchProgress(const recon::Ledger& ledger, const recon::BatchPlan& plan);
  /// Looks at the ledger, at most every second.
  void show();

 private:
  const recon::Ledger& ledger_;
  const recon::BatchPlan& plan_;
  SteadyClock clock_;
  Progress bar_;
  TimePoint begin_, next_;
  std::size_t before_;  ///< frames that were done then
};

/// "412 of 1000 frames, 2.1 frames a second, 4 min 40 s left".
std::string progress_words(std::size_t done, std::size_t frames, std::size_t since_begin, Seconds took);

}  // namespace emberlock::cli
