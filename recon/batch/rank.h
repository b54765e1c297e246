// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "base/quantity.h"
#include "recon/compute/device.h"

namespace emberlock::recon {

/// Which of the processes that mpirun or srun started this one is. They only start: ranks send no messages.
struct Rank {
  int number = 0;
  int count = 1;
  int on_machine = 0;        ///< among those of its machine
  int count_on_machine = 1;  ///< of those
  int threads = 0;           ///< that it may use, as it was told; 0: wasn't
};

/// From what Open MPI, Slurm's srun, or Hydra (MPICH, Intel MPI) put into the environment, in this order;
/// alone where none did. Numbers that don't parse count as not told.
Rank rank_from(const std::function<const char*(const char* name)>& environment);

/// One GPU a rank where there are GPUs: a rank takes the one of its number on the machine (the first where
/// Slurm shows each rank GPUs of its own), those behind the last GPU the CPU. `asked` where it names a
/// device. Error: that of resolve(), of a device that was named.
Result<Device> device_of(const Rank& rank, Device asked, bool own_gpus);

/// How long a rank that finds nothing to do waits until it asks again: together they ask fifty times a second
/// at most, as each time costs the shared folder two requests for each chunk that is at work, and each of
/// them asks three times within its `patience`.
Seconds idle_wait(const Rank& rank, Seconds patience);

/// CPU threads of a rank: its share of the machine's cores, no more than it may run on (its affinity).
int threads_of(const Rank& rank, int cores, int allowed);

}  // namespace emberlock::recon
