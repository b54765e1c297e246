// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/progress.h"
#include "base/result.h"
#include "paper/protocol.h"
#include "paper/run.h"

namespace emberlock::paper {

struct PaperOptions {
  Extent extent = Extent::full;
  std::vector<std::string> only;     ///< names of protocols; empty: all
  std::vector<std::string> methods;  ///< names of methods; empty: each protocol's
  std::optional<int> cells;          ///< of the simulated gas along each edge; default: kCells
  std::optional<int> voxels;         ///< of every reconstruction, 8..256; default: kVoxels
  std::uint64_t seed = 1;
  /// Every method runs on the CPU. The paper's and ours run on a GPU too: automatic, where one is to be had;
  /// cuda, or an error.
  recon::ComputeOptions compute;
  std::string machine;  ///< on which times are measured, in words; runs of another one aren't mixed with it

  static constexpr int kCells = 192, kVoxels = 128;
  static constexpr int kQuickCells = 64, kQuickVoxels = 48;
};

/// The pictures that a case's runs were given.
struct FilmedCase {
  std::string protocol, of;
  std::vector<RunPicture> pictures;  ///< names as those of a MethodRun
};

struct PaperEvaluation {
  PaperOptions options;  ///< with cells and voxels filled in
  std::vector<Protocol> protocols;
  std::vector<MethodRun> runs;  ///< in the protocols' order
  std::vector<FilmedCase> filmed;
  int taken_up = 0;  ///< runs that were done before
  Seconds total{0};
};

/// Films what the protocols ask for, runs every method on it, and keeps what is done in `folder`: truth/ (the
/// simulated gas as OpenVDB files) and runs/, a folder a run. What lies there with the same settings, of
/// the same program on the same machine, isn't done again, so a run that was interrupted goes on. A method
/// that fails is told in its run. Errors: bad_input for options and for a folder of other settings, `refused`
/// where the observer asks to end, io, not_converged where no run at all succeeds.
Result<PaperEvaluation> evaluate_paper(const PaperOptions& options, const std::filesystem::path& folder,
                                       const Clock& clock, const Observer& observer = {});

}  // namespace emberlock::paper
