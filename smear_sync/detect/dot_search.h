// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "smear_sync/detect/column_patch.h"

namespace emberlock::smear::detail {

/// A row of the lamp's lane that may be the middle of a dot.
struct Candidate {
  int row = 0;
  double y = 0;  ///< peak of the response, near that row
  double radius = 0;
  float z = 0;  ///< matched-filter response divided by its noise
};

struct Responses {
  std::vector<Candidate> candidates;  ///< top to bottom
  double scale = 1;                   ///< standard deviation of the empty lanes' responses; 1 for white noise
  double extreme = 0;                 ///< largest response in the empty lanes: the level that noise reaches
};

/// Applies the matched filter along the lamp's lane, and along the empty lanes beside it for comparison.
Responses search_lanes(const Column& column, double min_snr);

}  // namespace emberlock::smear::detail
