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
  std::string comb;  ///< a clip of one of the cameras under comb_rate flashes a second, or empty
  Hertz comb_rate{};
  std::optional<SecondsPerRow> row_time;  ///< where there is no comb
  smear::VerifyOptions verify{};          ///< its row time is that of the comb, else `row_time`
};

struct VerifyRunResult {
  smear::VerifyResult result;
  std::vector<FilmedClip> clips;  ///< as result.cameras
  std::optional<FilmedClip> comb;
  std::optional<smear::RowClock> row_clock;  ///< of the comb
  std::vector<std::string> notes;            ///< what an operator should know of the row time
};

/// Reads the clips and judges them. Errors (bad_input): files that can't be read, one clip, no row time, a
/// comb that isn't one.
Result<VerifyRunResult> run_verify(const VerifyRunOptions& options, const Progress& progress);

/// {"reference", "cameras": [{"file", "error_ms", "sigma_ms", "frame_offset", "drift_ppm", "state",
/// "offset_by", "offset_probability", "offset_reason"}], "worst_pair_ms", "verdict"}; what isn't known is
/// null. `offset_by`: "code", "pattern" or "pattern and sound"; null of the reference and where there is no
/// offset.
nlohmann::ordered_json verify_json(const smear::VerifyResult& result);

}  // namespace emberlock::films
