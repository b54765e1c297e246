// SPDX-License-Identifier: Apache-2.0
#include "paper/protocol.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include <gmock/gmock.h>

#include "paper/methods.h"

namespace emberlock::paper {
namespace {
using testing::HasSubstr;

std::ptrdiff_t inputs(const Case& of) {
  return std::count_if(of.cameras.begin(), of.cameras.end(),
                       [](const CameraPlace& c) { return c.role == recon::ViewRole::input; });
}

TEST(Protocol, CasesAreWhatThePaperFilms) {
  const Case nine = nine_views_protocol(Extent::full).cases.at(0);
  EXPECT_EQ(nine.cameras.size(), 10);
  EXPECT_EQ(inputs(nine), 9);
  EXPECT_EQ(nine.image, (ImageSize{640, 480}));
  for (std::size_t i = 1; i < nine.cameras.size(); ++i)
    EXPECT_NEAR(nine.cameras[i].azimuth - nine.cameras[i - 1].azimuth, 36, 1e-9);
  const Case wu = four_views_protocol(Extent::full).cases.at(0);
  EXPECT_EQ(wu.image, (ImageSize{200, 310}));
  EXPECT_EQ(inputs(wu), 4);
  EXPECT_EQ(wu.cameras[3].azimuth, 135);
  const Case smoke = smoke_protocol(Extent::full).cases.at(0);
  EXPECT_EQ(smoke.cameras.size(), 47);
  EXPECT_EQ(inputs(smoke), 3);
  const Protocol cameras = cameras_protocol(Extent::full);
  EXPECT_EQ(inputs(cameras.cases.front()), 4);
  EXPECT_EQ(inputs(cameras.cases.back()), 28);
}

TEST(Protocol, ATestViewOfEveryRingLiesBetweenTwoCameras) {
  for (const Case& of : cameras_protocol(Extent::full).cases) {
    double nearest = 360;
    for (const CameraPlace& c : of.cameras)
      if (c.role == recon::ViewRole::input)
        nearest = std::min(nearest, std::abs(std::remainder(c.azimuth - of.cameras.back().azimuth, 360)));
    EXPECT_NEAR(nearest, 180.0 / static_cast<double>(inputs(of)), 1e-9) << of.name;
  }
}

TEST(Protocol, EachNamesMethodsThatExistAndSaysHowItDiffers) {
  for (const Extent extent : {Extent::full, Extent::quick})
    for (const Protocol& protocol : protocols(extent)) {
      std::set<std::string> names;
      for (const Case& of : protocol.cases) EXPECT_TRUE(names.insert(of.name).second) << of.name;
      EXPECT_FALSE(protocol.cases.empty());
      EXPECT_FALSE(protocol.differs.empty());
      for (const std::string_view method : protocol.methods) EXPECT_TRUE(find_method(method).ok()) << method;
      for (const PrintedErrors& p : protocol.printed) EXPECT_TRUE(find_method(p.method).ok()) << p.method;
    }
}

TEST(Protocol, AnUnknownTableOrMethodListsThoseThatAre) {
  EXPECT_THAT(choose_protocols({"table-1"}, Extent::full).error().message(), HasSubstr("nine-views"));
  EXPECT_THAT(find_method("magic").error().message(), HasSubstr("emberlock"));
  const auto two = choose_protocols({"smoke", "iterations"}, Extent::quick);
  ASSERT_TRUE(two.ok());
  EXPECT_EQ(two->size(), 2);
  EXPECT_EQ(two->front().name, "iterations");
}

}  // namespace
}  // namespace emberlock::paper
