// SPDX-License-Identifier: Apache-2.0
#include "recon/batch/rank.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>

namespace emberlock::recon {

Rank rank_from(const std::function<const char*(const char* name)>& environment) {
  const auto number = [&](const char* name) -> std::optional<int> {
    const char* text = environment(name);
    if (text == nullptr) return std::nullopt;
    const std::string_view words(text);  // "4", and "2(x3)" of Slurm's tasks on nodes
    int value = 0;
    const auto [end, error] = std::from_chars(words.data(), words.data() + words.size(), value);
    if (error != std::errc() || end == words.data() || value < 0) return std::nullopt;
    return value;
  };
  struct Names {
    const char *rank, *count, *on_machine, *count_on_machine;
  };
  constexpr Names kLaunchers[] = {
      {"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_LOCAL_RANK",
       "OMPI_COMM_WORLD_LOCAL_SIZE"},
      {"SLURM_PROCID", "SLURM_NTASKS", "SLURM_LOCALID", "SLURM_TASKS_PER_NODE"},
      {"PMI_RANK", "PMI_SIZE", "MPI_LOCALRANKID", "MPI_LOCALNRANKS"},
  };
  Rank rank;
  for (const Names& names : kLaunchers) {
    const auto found = number(names.rank);
    if (!found) continue;
    rank.number = *found;
    rank.count = std::max(number(names.count).value_or(1), rank.number + 1);
    rank.on_machine = number(names.on_machine).value_or(0);
    rank.count_on_machine = std::max(number(names.count_on_machine).value_or(1), rank.on_machine + 1);
    break;
  }
  rank.threads = number("SLURM_CPUS_PER_TASK").value_or(0);
  return rank;
}

Result<Device> device_of(const Rank& rank, Device asked, bool own_gpus) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Device found, resolve(asked));
  if (asked != Device::automatic || found != Device::cuda) return found;
  const int number = found.gpu + (own_gpus ? 0 : rank.on_machine);
  const Result<Device> gpu = resolve({Device::cuda, number});
  return gpu ? *gpu : Device(Device::cpu);
}

Seconds idle_wait(const Rank& rank, Seconds patience) {
  constexpr Seconds kShortest{0.1}, kOfEachRank{0.02};
  return std::max(kShortest, std::min(rank.count * kOfEachRank, patience / 3));
}

int threads_of(const Rank& rank, int cores, int allowed) {
  int threads = std::min(allowed, std::max(1, cores / rank.count_on_machine));
  if (rank.threads > 0) threads = std::min(threads, rank.threads);
  return std::max(1, threads);
}

}  // namespace emberlock::recon
