// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "recon/calibrate/bundle.h"

namespace emberlock::recon {

struct CleanOptions {
  double corner_limit = 4;   ///< a corner further off than so many standard deviations is wrong
  double view_limit = 2;     ///< a view whose RMS is so many times its camera's median view's is wrong,
  double view_spread = 5;    ///< if it also lies so many robust standard deviations above that median
  double wrong_share = 0.5;  ///< a view more of whose corners are wrong is wrong
  int rounds = 12;           ///< of solving and rejecting, at most
};

/// A view left out, and why.
struct RejectedView {
  std::size_t view = 0;  ///< of Bundle.views
  std::string why;
};

/// Adjusts and rejects by turns until nothing changes: wrong corners and views (by their cameras' median
/// absolute deviations, so that what is wrong doesn't judge), and finds each camera's noise. At first wrong
/// corners pull little, at the end not at all. Of an instant that several cameras see, only the worst view is
/// rejected at a time: it spoils the others'.
Result<std::vector<RejectedView>> clean(Bundle& bundle, const CleanOptions& options = {});

}  // namespace emberlock::recon
