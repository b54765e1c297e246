#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/progress.h"
#include "base/result.h"
#include "cli/clip_reader.h"
#include "smear_sync/clocks/row_clock.h"
#include "smear_sync/verify/verify.h"

namespace emberlock::cli {

struct VerifyRunOptions {
  std::vector<std::string> clips;  ///< two or more
  std::string comb;  ///< a clip of one of the cameras under comb_rate flashes a second, or empty
  Hertz comb_rate{};
  std::optional<SecondsPerRow> row_time;  ///< where there is no comb
  VerifyOptions verify{};                 ///< its row time is that of the comb, else `row_time`
};

struct VerifyRunResult {
  VerifyResult result;
  std::vector<FilmedClip> clips;  ///< as result.cameras
  std::optional<FilmedClip> comb;
  std::optional<RowClock> row_clock;  ///< of the comb
  std::vector<std::string> notes;     ///< what an operator should know of the row time
};

/// Reads the clips and judges them. Errors (bad_input): files that can't be read, one clip, no row time, a
/// comb that isn't one.
Result<VerifyRunResult> run_verify(const VerifyRunOptions& options, const Progress& progress);

/// {"reference", "cameras": [{"file", "error_ms", "sigma_ms", "frame_offset", "drift_ppm", "state"}],
/// "worst_pair_ms", "verdict"}; what isn't known is null.
nlohmann::ordered_json verify_json(const VerifyResult& result);

/// Writes report.html, which stands alone, into `folder`: the verdict, what to do, and the evidence.
Status write_verify_report(const VerifyRunResult& run, const std::filesystem::path& folder);

}  // namespace emberlock::cli
