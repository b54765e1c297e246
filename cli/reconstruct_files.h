// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "base/progress.h"
#include "cli/progress_stream.h"
#include "cli/reconstruct_arguments.h"
#include "cli/reconstruct_summary.h"

namespace emberlock::cli {

/// The receivers of progress: the terminal, or another program.
struct Watchers {
  Progress progress;
  std::function<bool()> stop = {};  ///< true: end with the best so far
  ProgressStream* stream = nullptr;
};

/// How a scene becomes a volume.
using SolveScene = std::function<Result<recon::Outcome>(
    const recon::Scene& scene, const recon::ReconstructOptions& options, const Clock& clock,
    const Progress& progress, const std::function<void(const recon::Preview&)>& preview)>;

/// From files to files: loads the views, reconstructs, by recon::reconstruct() unless told otherwise, and
/// writes what came out.
Result<Written> reconstruct_files(const ReconstructArguments& arguments, const Watchers& watchers,
                                  const SolveScene& solve = recon::reconstruct);

/// Before the work starts: more voxels than the pictures tell apart cost much and bring nothing.
void warn_if_too_fine(const recon::Scene& scene, const recon::ReconstructOptions& options, std::FILE* to);

}  // namespace emberlock::cli
