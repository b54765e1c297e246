// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/quantity.h"
#include "base/result.h"
#include "recon/adjust/solver.h"
#include "recon/pipeline/reconstruct.h"

namespace emberlock::cli {

/// A reconstruction, what was asked of it, and how long files took before and after it.
struct Written {
  recon::Outcome outcome;
  recon::SolveOptions asked;
  Seconds loading{0}, writing{0};
  std::string certificate;  ///< in words: by whom signed, what was hashed, how long that took
};

/// Where it came from and went, and how it is told.
struct WrittenTo {
  std::string input, out;
  bool json = false;
};

/// Prints what came out, or report.json. Error: that isn't what was asked for, though it is written.
Status conclude(const Written& written, const WrittenTo& where);
/// Error: temperatures were asked for, and no voxel tells one.
Status temperature_told(const recon::Report& report, const WrittenTo& where);

}  // namespace emberlock::cli
