// SPDX-License-Identifier: Apache-2.0
#include "cli/progress_lines.h"

#include <gtest/gtest.h>

namespace emberlock::cli {
namespace {

TEST(ProgressLines, AreOneASecondAtMostHoweverFastWorkGetsOn) {
  std::optional<double> last;
  int lines = 0;
  for (int bar = 0; bar < 3; ++bar) {  // one after the other, 2 s each, of a report a millisecond
    ProgressLines progress;
    for (int i = 0; i < 2000; ++i)
      if (progress.due(i / 2000.0, 2 * bar + i / 1000.0, last)) ++lines;
  }
  EXPECT_LE(lines, 6);
  EXPECT_GE(lines, 5);
}

TEST(ProgressLines, AreOneATenthAtMostHoweverSlowItIs) {
  std::optional<double> last;
  ProgressLines progress;
  int lines = 0;
  for (int second = 0; second < 1000; ++second)
    if (progress.due(second / 1000.0, second, last)) ++lines;
  EXPECT_EQ(lines, 10);
}

}  // namespace
}  // namespace emberlock::cli
