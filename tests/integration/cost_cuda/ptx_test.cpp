// SPDX-License-Identifier: Apache-2.0
// An effect that is off costs no instructions on the GPU either: counted in the PTX of the library's functors
// under no extinction and of marches written down for emission alone.
#include <cctype>
#include <map>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/shell.h"

namespace emberlock {
namespace {

/// How often each instruction stands in a kernel, by its name before the first dot and its last part:
/// "mul.f32".
using Count = std::map<std::string, int>;

std::map<std::string, Count> count_instructions(const std::string& ptx) {
  std::map<std::string, Count> kernels;
  std::istringstream lines(ptx);
  std::string kernel;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t entry = line.find(".entry ");
    if (entry != std::string::npos) kernel = line.substr(entry + 7, line.find('(') - entry - 7);
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (!word.empty() && word[0] == '@') words >> word;  // a predicate
    if (word.empty() || std::islower(static_cast<unsigned char>(word[0])) == 0) continue;
    if (word.back() == ';') word.pop_back();
    const std::size_t first = word.find('.');
    const std::size_t last = word.rfind('.');
    ++kernels[kernel][first == std::string::npos ? word : word.substr(0, first) + word.substr(last)];
  }
  return kernels;
}

int total(const Count& count) {
  int sum = 0;
  for (const auto& [name, times] : count) sum += times;
  return sum;
}
int exponentials(const Count& count) {
  int sum = 0;
  for (const auto& [name, times] : count)
    if (name.starts_with("ex2")) sum += times;
  return sum;
}
int products(const Count& count) {
  const auto at = count.find("mul.f32");
  return at == count.end() ? 0 : at->second;
}

TEST(CostCuda, MarchesWithoutExtinctionHaveTheInstructionsOfEmissionAlone) {
  const std::string nvcc = EMBERLOCK_COST_NVCC;
  const Shell run = shell(nvcc + " -std=c++20 -O3 --fmad=false -ptx -o /dev/stdout -I " EMBERLOCK_SOURCE_DIR
                                 " " EMBERLOCK_SOURCE_DIR "/tests/integration/cost/program/march.cu");
  ASSERT_EQ(run.status, 0) << run.output;
  std::map<std::string, Count> kernels = count_instructions(run.output);
  for (const std::string march : {"forward", "adjoint"}) {
    const Count& none = kernels[march + "_none"];
    const Count& by_hand = kernels[march + "_by_hand"];
    const Count& constant = kernels[march + "_constant"];
    ASSERT_GT(total(by_hand), 100) << march;
    EXPECT_NEAR(total(none), total(by_hand), 0.01 * total(by_hand)) << march;
    EXPECT_EQ(products(none), products(by_hand)) << march << ": no product by a transmittance";
    EXPECT_EQ(exponentials(none), 0) << march;
    EXPECT_GT(exponentials(constant), 0) << march << ": what is on is seen to cost";
    EXPECT_GT(products(constant), products(none)) << march;
  }
}

}  // namespace
}  // namespace emberlock
