// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "base/progress.h"
#include "base/result.h"
#include "rig/align/bench.h"
#include "rig/align/run.h"
#include "smear_sync/clocks/row_clock.h"

namespace emberlock::rig {

/// A mean of row times, each weighing by its standard error.
class MeanRowTime {
 public:
  void add(const smear::RowClock& clock);
  [[nodiscard]] std::optional<SecondsPerRow> value() const;

 private:
  double weights_ = 0;
  double moment_ = 0;
};

/// t_row of every CCD from a comb, into `result`. CCDs whose comb can't be read keep the mean of the others.
/// Nothing is measured when it is stopped. Errors: the devices', and device where no comb can be read.
Status measure_row_times(const AlignRig& rig, AlignBench& bench, const AlignRunOptions& options,
                         AlignRunResult& result, const Progress& progress);

}  // namespace emberlock::rig
