// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace emberlock::cli {

/// What Slurm is asked for.
struct SlurmJob {
  int nodes = 1;
  int ranks = 1;                          ///< a node
  int gpus = 0;                           ///< a node
  int cpus = 0;                           ///< a rank; 0: Slurm's rule
  std::string time = {};                  ///< the limit, as sbatch takes it
  std::vector<std::string> further = {};  ///< options of sbatch's
};

/// The sbatch script of a batch, as one step that lives on while nodes and ranks die; a job whose first node
/// dies is queued again and goes on. `words` are the rank's command line, `out` the batch's folder.
std::string sbatch_script(const SlurmJob& job, const std::vector<std::string>& words,
                          const std::filesystem::path& out);

/// Writes OUT/slurm/batch.sbatch and submits it; remembers the job's number in OUT/slurm/job, and returns it.
/// Errors: sbatch isn't installed, or refuses.
Result<std::string> submit(const std::string& script, const std::filesystem::path& out);

/// What squeue tells of the job that was submitted for this folder; empty where none was. Errors: squeue
/// isn't installed, or fails.
Result<std::string> job_state(const std::filesystem::path& out);

}  // namespace emberlock::cli
