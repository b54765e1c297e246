// SPDX-License-Identifier: Apache-2.0
#include "base/nearest.h"

#include <gtest/gtest.h>

namespace emberlock {
namespace {

TEST(Nearest, IsWhatWasProbablyMeant) {
  const std::vector<std::string> verbs{"devices", "align", "calibrate", "status", "strobe"};
  EXPECT_EQ(nearest("allign", verbs), "align");
  EXPECT_EQ(nearest("aling", verbs), "align");
  EXPECT_EQ(nearest("calibarte", verbs), "calibrate");
  EXPECT_EQ(nearest("stats", verbs), "status");
}

TEST(Nearest, IsNothingWhereNothingIsSimilar) {
  EXPECT_EQ(nearest("frobnicate", {"align", "status"}), std::nullopt);
  EXPECT_EQ(nearest("align", {}), std::nullopt);
  EXPECT_EQ(nearest("x", {"", "align"}), std::nullopt);
  EXPECT_EQ(nearest(std::string(std::size_t{1} << 20U, 'a'), {"align"}), std::nullopt);
}

}  // namespace
}  // namespace emberlock
