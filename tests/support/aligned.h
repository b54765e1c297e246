// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rig/align/json.h"
#include "rig/align/record.h"
#include "tests/support/small_rig.h"
#include "tests/support/temp_folder.h"

namespace emberlock::test {

/// What phases may be off by in a small rig's pictures.
constexpr Rows kReadingError{1};

inline void expect_aligned_in_truth(SmallBench& bench) {
  const auto result = rig::run_align(bench.align, bench.options);
  ASSERT_TRUE(result.ok()) << result.error().message();
  ASSERT_EQ(result->last.verdict, smear::AlignVerdict::aligned) << result->words.reason;
  const SecondsPerRow row = result->options.row_time;
  EXPECT_LT(bench.true_error(row), result->options.tolerance.in_rows(row) + kReadingError);
}

/// Records an alignment, runs it again from the recording, and compares every line. Returns the lines.
inline std::vector<std::string> expect_replays(SmallBench& bench, const rig::StopAsked& stop = {}) {
  const TempFolder temp;
  const std::filesystem::path folder = temp / "session";
  std::vector<std::string> live;
  std::vector<std::string> again;
  const auto into = [](std::vector<std::string>& lines) {
    return [&lines](const rig::AlignRoundReport& r) { lines.push_back(rig::round_json(r).dump()); };
  };
  const auto recorded = rig::record_align(folder, bench.align, bench.options, into(live), {}, stop);
  EXPECT_TRUE(recorded.ok());
  const auto replayed = rig::replay_align(folder, into(again));
  EXPECT_TRUE(replayed.ok());
  EXPECT_EQ(live, again);
  return live;
}

}  // namespace emberlock::test
