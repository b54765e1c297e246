// SPDX-License-Identifier: Apache-2.0
// Whole outputs against what they were when somebody last looked at them. After a wanted change:
//   EMBERLOCK_UPDATE_GOLDEN=1 build/release/bin/golden_cli
// remakes the files beside this one; their diff is the review.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/file.h"
#include "recon/export/report.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/synthetic/flame.h"
#include "rig/align/json.h"
#include "tests/support/small_rig.h"

namespace emberlock::cli {
namespace {

/// Numbers to five significant digits: the rest says nothing to a reader of the diff.
nlohmann::ordered_json rounded(const nlohmann::ordered_json& json) {
  if (json.is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof text, "%.5g", json.get<double>());
    return std::strtod(text, nullptr);
  }
  nlohmann::ordered_json result = json;
  if (json.is_structured()) {
    for (auto& item : result.items()) item.value() = rounded(item.value());
  }
  return result;
}

/// A text with every number replaced by '#', and those numbers: sentences hold numbers too.
struct Figures {
  std::string text;
  std::vector<double> numbers;
};

Figures figures(const std::string& text) {
  static const std::regex number(R"(-?\d+(\.\d+)?([eE][-+]?\d+)?)");
  Figures result;
  auto end_of_last = text.begin();
  for (std::sregex_iterator match(text.begin(), text.end(), number); match != std::sregex_iterator();
       ++match) {
    result.text.append(end_of_last, text.begin() + match->position()) += '#';
    result.numbers.push_back(std::stod(match->str()));
    end_of_last = text.begin() + match->position() + match->length();
  }
  result.text.append(end_of_last, text.end());
  return result;
}

/// Single precision sums differ in their last digits between processors and compilers' options, and one unit
/// in the last digit of a number of three digits is the most that this can make of them.
constexpr double kSameFigure = 5e-3;

void expect_golden(const std::string& name, const std::string& text) {
  const std::filesystem::path file = std::filesystem::path(EMBERLOCK_SOURCE_DIR) / "tests/golden/cli" / name;
  if (std::getenv("EMBERLOCK_UPDATE_GOLDEN") != nullptr) {  // NOLINT(concurrency-mt-unsafe): one thread
    ASSERT_TRUE(write_file_atomically(file, text).ok());
  }
  const auto golden = read_file(file);
  ASSERT_TRUE(golden.ok()) << golden.error().message();
  const Figures now = figures(text);
  const Figures then = figures(*golden);
  EXPECT_EQ(now.text, then.text);
  ASSERT_EQ(now.numbers.size(), then.numbers.size());
  for (std::size_t i = 0; i < now.numbers.size(); ++i) {
    EXPECT_NEAR(now.numbers[i], then.numbers[i], kSameFigure * std::abs(then.numbers[i]))
        << name << ": number " << i << " of the file";
  }
}

TEST(Golden, AlignmentOfASmallRig) {
  test::SmallBench bench(test::small_rig(7));
  bench.options.align.policy = smear::AlignPolicy::timed;
  bench.options.seed = 7;
  std::string lines;
  const auto result = rig::run_align(bench.align, bench.options, [&](const rig::AlignRoundReport& report) {
    lines += rounded(rig::round_json(report)).dump() + "\n";
  });
  ASSERT_TRUE(result.ok()) << result.error().message();
  lines += rounded(rig::summary_json(*result, 7)).dump() + "\n";
  expect_golden("align_small_rig.jsonl", lines);
}

/// A clock that stands still, so that a report holds no times.
class StoppedClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override { return {}; }
  void sleep_until(TimePoint) override {}
};

TEST(Golden, ReportOfASmallReconstruction) {
  recon::PaperSceneOptions scene;
  scene.image = {96, 72};
  scene.truth_voxels = 32;
  recon::ReconstructOptions options;
  options.voxels = 24;
  options.solve.compute = {recon::Device::cpu, 2};
  options.solve.iterations = 4;
  const StoppedClock clock;
  auto outcome = recon::reconstruct(recon::paper_scene(scene), options, clock);
  ASSERT_TRUE(outcome.ok()) << outcome.error().message();
  outcome->report.input = "paper_scene";
  expect_golden("report_small_reconstruction.json",
                rounded(nlohmann::ordered_json::parse(recon::to_json(outcome->report))).dump(1) + "\n");
}

}  // namespace
}  // namespace emberlock::cli
