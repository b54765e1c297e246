// SPDX-License-Identifier: Apache-2.0
// An effect that is off costs no instructions: the library's marches under no extinction against marches
// written down for emission alone, compiled alike, counted by valgrind's callgrind.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "recon/render/march_table.h"
#include "tests/integration/cost/callgrind.h"

namespace emberlock {
namespace {

struct Level {
  recon::Isa isa;
  const char* name;
  const char* program;  ///< compiled for this level
};
/// Those that this CPU runs.
std::vector<Level> levels() {
  std::vector<Level> all{{recon::Isa::baseline, "baseline", EMBERLOCK_COST_MARCH},
                         {recon::Isa::v3, "v3", EMBERLOCK_COST_MARCH_V3}};
  std::erase_if(all, [](const Level& level) { return level.isa > recon::best_isa(); });
  return all;
}

class Cost : public testing::TestWithParam<Level> {
 protected:
  void SetUp() override {
    ASSERT_EQ(shell("valgrind --version").status, 0) << "valgrind is missing: run scripts/setup";
  }

  /// Executed by the case's work.
  [[nodiscard]] static double instructions(const std::string& name) {
    const Level& level = GetParam();
    const Counted run = count_instructions(level.program, name, std::string("EMBERLOCK_ISA=") + level.name);
    EXPECT_NE(run.output.find(std::string("\n") + level.name + " "), std::string::npos) << run.output;
    return run.instructions;
  }
};

TEST_P(Cost, MarchWithoutExtinctionIsAMarchOfEmissionAlone) {
  const double by_hand = instructions("forward_by_hand");
  EXPECT_GT(by_hand, 1e5);
  EXPECT_NEAR(instructions("forward_none") / by_hand, 1, 0.01);
  EXPECT_GT(instructions("forward_constant") / by_hand, 1.05) << "what is on is seen to cost";
}

TEST_P(Cost, TransposeWithoutExtinctionIsThatOfEmissionAlone) {
  const double by_hand = instructions("adjoint_by_hand");
  EXPECT_GT(by_hand, 1e5);
  EXPECT_NEAR(instructions("adjoint_none") / by_hand, 1, 0.01);
  EXPECT_GT(instructions("adjoint_constant") / by_hand, 1.05) << "what is on is seen to cost";
}

TEST_P(Cost, PictureWithoutEffectsIsAMarchAndNoMore) {
  const double by_hand = instructions("picture_by_hand");
  EXPECT_LE(instructions("picture") / by_hand, 1.01);
  EXPECT_GT(instructions("picture_of_effects") / by_hand, 1.05) << "what is on is seen to cost";
}

INSTANTIATE_TEST_SUITE_P(Levels, Cost, testing::ValuesIn(levels()),
                         [](const auto& level) { return std::string(level.param.name); });

}  // namespace
}  // namespace emberlock
