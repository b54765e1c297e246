// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "base/result.h"
#include "cli/reconstruct_arguments.h"
#include "recon/batch/plan.h"
#include "recon/batch/rank.h"

namespace emberlock::cli {

/// The command line of `emberlock batch`, as typed.
struct BatchArguments {
  ReconstructArguments reconstruct;
  int chunk = 0;           ///< frames; 0: usual_chunk()
  double patience_s = 60;  ///< until a rank of another machine that isn't heard of counts as dead
  std::map<std::string, std::string> options;  ///< that were given, and what results depend on
};

/// What is asked for, with the chunk and the voxels as far as they are told. Errors: no session, frames
/// beyond it, options that contradict each other, an --out in the session's folder or with a batch of
/// something else.
Result<recon::BatchPlan> asked_plan(const BatchArguments& arguments);

/// One rank of a batch: takes chunks from OUT/batch (recon/batch/ledger.h) until all are done, by whomever.
/// Each chunk is a sequence of its own, from darkness (cli/frames_in_turn.h), so that its volumes don't
/// depend on who does it. SIGINT and SIGTERM end it: its chunk goes back, with the frames that are done. The
/// first rank that lives tells how far all are, writes OUT/sequence, and exits with code 1 where not all are
/// volumes.
void run_batch_rank(const BatchArguments& arguments, const recon::Rank& rank);

}  // namespace emberlock::cli
