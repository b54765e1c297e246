// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "recon/calibrate/bundle.h"

namespace emberlock::recon {

struct CleanOptions {
  double corner_limit = 4;   ///< standard deviations; a corner with a larger residual is wrong
  double view_limit = 2;     ///< a view is wrong if its RMS exceeds its camera's median view by this factor,
  double view_spread = 5;    ///< and by this many robust standard deviations
  double wrong_share = 0.5;  ///< a view with a larger share of wrong corners is wrong
  int rounds = 12;           ///< maximum number of rounds of solving and rejecting
};

/// A rejected view, and the reason.
struct RejectedView {
  std::size_t view = 0;  ///< index in Bundle.views
  std::string why;
};

/// Alternates between adjusting and rejecting until nothing changes: rejects wrong corners and views (by
/// their cameras' median absolute deviations, which are robust against them), and estimates each camera's
/// noise. Wrong corners have little influence at first, and none at the end. Of the views of one instant only
/// the worst is rejected per round, because it spoils the others.
Result<std::vector<RejectedView>> clean(Bundle& bundle, const CleanOptions& options = {});

}  // namespace emberlock::recon
