// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "smear_sync/detect/column_patch.h"

namespace emberlock::smear::detail {

/// A row of the lamp's lane that looks like the middle of a dot.
struct Candidate {
  int row = 0;
  double y = 0;  ///< of the response's peak, near that row
  double radius = 0;
  float z = 0;  ///< matched-filter response over its noise
};

struct Responses {
  std::vector<Candidate> candidates;  ///< top to bottom
  double scale = 1;                   ///< of the empty lanes' responses: 1 when noise is white
  double extreme = 0;                 ///< of the empty lanes' responses: what is no dot reaches so high
};

/// Matched filter along the lamp's lane, and along the empty ones beside it for comparison.
Responses search_lanes(const Column& column, double min_snr);

}  // namespace emberlock::smear::detail
