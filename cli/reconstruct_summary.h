// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/quantity.h"
#include "base/result.h"
#include "recon/adjust/solver.h"
#include "recon/pipeline/reconstruct.h"

namespace emberlock::cli {

/// A reconstruction, and how long files took before and after it.
struct Written {
  recon::Outcome outcome;
  Seconds loading{0}, writing{0};
};

/// Where it came from and went, and how it is told.
struct WrittenTo {
  std::string input, out;
  bool json = false;
};

/// Prints what came out, or report.json. Error: that isn't what was asked for, though it is written.
Status conclude(const Written& written, const recon::SolveOptions& asked, const WrittenTo& where);

}  // namespace emberlock::cli
