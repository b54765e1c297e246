// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/progress.h"
#include "base/result.h"
#include "films/clip_reader.h"
#include "smear_sync/clocks/row_clock.h"
#include "smear_sync/verify/verify.h"

namespace emberlock::films {

struct VerifyRunOptions {
  std::vector<std::string> clips;  ///< two or more
  std::string comb;  ///< a clip of one of the cameras under comb_rate flashes per second, or empty
  Hertz comb_rate{};
  std::optional<SecondsPerRow> row_time;  ///< if there is no comb
  smear::VerifyOptions verify{};          ///< its row time comes from the comb, else from `row_time`
};

struct VerifyRunResult {
  smear::VerifyResult result;
  std::vector<FilmedClip> clips;  ///< same order as result.cameras
  std::optional<FilmedClip> comb;
  std::optional<smear::RowClock> row_clock;  ///< measured in the comb
  std::vector<std::string> notes;            ///< hints for the operator on the row time
};

/// Reads the clips and verifies that they are in sync. Errors (bad_input): unreadable files, a single clip,
/// no row time, a comb that doesn't show one.
Result<VerifyRunResult> run_verify(const VerifyRunOptions& options, const Progress& progress);

/// {"reference", "cameras": [{"file", "error_ms", "sigma_ms", "frame_offset", "drift_ppm", "state",
/// "offset_by", "offset_probability", "offset_reason"}], "worst_pair_ms", "verdict"}; unknown values are
/// null. `offset_by` is "code", "pattern" or "pattern and sound"; null for the reference and without an
/// offset.
nlohmann::ordered_json verify_json(const smear::VerifyResult& result);

}  // namespace emberlock::films
