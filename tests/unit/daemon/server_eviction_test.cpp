// SPDX-License-Identifier: Apache-2.0
// Who makes room when all places are taken: whoever comes often displaces himself, not others.
#include <random>

#include <gtest/gtest.h>

#include "daemon/server/eviction.h"

namespace emberlock::daemon {
namespace {

TEST(ServerEviction, OfTheGroupThatHasMostTheOneThatWaitsLongestLeaves) {
  EXPECT_EQ(choose_evicted({}), std::nullopt);
  EXPECT_EQ(choose_evicted({{"a", 0, 1}, {"b", 0, 2}, {"b", 0, 3}}), 1U);
  EXPECT_EQ(choose_evicted({{"a", 0, 9}, {"b", 0, 2}}), 1U) << "groups alike: whoever waits longest";
}

TEST(ServerEviction, LowerRanksLeaveFirstHoweverFewTheyAre) {
  EXPECT_EQ(choose_evicted({{"a", 1, 1}, {"a", 1, 2}, {"a", 1, 3}, {"b", 0, 4}}), 3U);
  EXPECT_EQ(choose_evicted({{"a", 1, 1}, {"b", 0, 5}, {"b", 0, 4}, {"b", 1, 0}}), 2U);
}

// A room of 32; a flood of 1 to 8 sources comes without end, the operator's connection among them, once. As
// long as one of the flood's sources has two places or more, the operator keeps his.
TEST(ServerEviction, NobodyIsDisplacedByAGroupThatHasMore) {
  std::mt19937 random(1);
  for (unsigned sources = 1; sources <= 8; ++sources) {
    std::vector<Occupant> room;
    std::uint64_t turn = 0;
    const auto enter = [&](const std::string& group) {
      if (room.size() == 32) room.erase(room.begin() + static_cast<std::ptrdiff_t>(*choose_evicted(room)));
      room.push_back({group, 0, ++turn});
    };
    for (int i = 0; i < 100; ++i) enter("flood " + std::to_string(random() % sources));
    enter("operator");
    for (int i = 0; i < 2000; ++i) {
      enter("flood " + std::to_string(random() % sources));
      ASSERT_TRUE(
          std::any_of(room.begin(), room.end(), [](const Occupant& g) { return g.group == "operator"; }))
          << sources << " sources, after " << i;
    }
  }
}

}  // namespace
}  // namespace emberlock::daemon
