// SPDX-License-Identifier: Apache-2.0
#include "base/one_to_one.h"

#include <string_view>

#include <gtest/gtest.h>

#include "base/sensor_kind.h"

namespace emberlock {
namespace {

constexpr OneToOne<int, std::string_view, 2> kWords{{{{1, "one"}, {2, "two"}}}};

TEST(OneToOne, LooksUpEitherWayWhileCompiling) {
  static_assert(kWords.second_of(2) == "two");
  static_assert(kWords.first_of("one") == 1);
  EXPECT_EQ(kWords.second_of(3), std::nullopt);
  EXPECT_EQ(kWords.first_of("three"), std::nullopt);
}

TEST(OneToOne, ASensorsNameLeadsBackToIt) {
  for (const auto kind : {SensorKind::ccd, SensorKind::rolling_shutter, SensorKind::global_shutter})
    EXPECT_EQ(kSensorNames.first_of(name(kind)), kind);
}

}  // namespace
}  // namespace emberlock
