// SPDX-License-Identifier: Apache-2.0
#include "report/camera_plan.h"

#include <cmath>
#include <utility>

#include <gmock/gmock.h>

namespace emberlock::report {
namespace {
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::Pair;

/// `cameras` on an arc around the origin, looking at it; up is z.
std::vector<PlanCamera> arc(int cameras, double degrees) {
  std::vector<PlanCamera> result;
  for (int i = 0; i < cameras; ++i) {
    const double azimuth = degrees * i / cameras * M_PI / 180;
    const Eigen::Vector3d at(0.3 * std::cos(azimuth), 0.3 * std::sin(azimuth), i % 2 == 0 ? 0.05 : -0.05);
    result.push_back({"CAM-" + std::to_string(i), at, -at, Eigen::Vector3d::UnitZ()});
  }
  return result;
}

std::vector<std::pair<std::size_t, std::size_t>> neighbours(const std::vector<PlanCamera>& cameras) {
  std::vector<std::pair<std::size_t, std::size_t>> result;
  for (const Baseline& pair : baselines(cameras)) result.emplace_back(pair.a, pair.b);
  return result;
}

TEST(CameraPlan, NeighboursOfARingAreThoseSideBySideAndAnArcIsNotClosed) {
  EXPECT_THAT(neighbours(arc(6, 360)),
              ElementsAre(Pair(0, 1), Pair(0, 5), Pair(1, 2), Pair(2, 3), Pair(3, 4), Pair(4, 5)));
  EXPECT_THAT(neighbours(arc(4, 120)), ElementsAre(Pair(0, 1), Pair(1, 2), Pair(2, 3)));
}

TEST(CameraPlan, NeighboursInAnArrayStandAboveOneAnotherToo) {
  std::vector<PlanCamera> cameras;
  for (int i = 0; i < 4; ++i)
    cameras.push_back({"", Eigen::Vector3d(i % 2, 0, i / 2), Eigen::Vector3d::UnitY()});
  EXPECT_THAT(neighbours(cameras), ElementsAre(Pair(0, 1), Pair(0, 2), Pair(1, 3), Pair(2, 3)));
}

TEST(CameraPlan, BaselinesAreLengthsAndAnglesBetweenViews) {
  const auto pairs = baselines({{"", {1, 0, 0}, {-2, 0, 0}}, {"", {0, 1, 0}, {0, -1, 0}}});
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_NEAR(pairs[0].length, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(pairs[0].angle, M_PI / 2, 1e-12);
}

TEST(CameraPlan, PageNamesEveryCameraAndDrawsItFromAboveAndFromTheSide) {
  HtmlPage page("plan");
  add_camera_plan(page, arc(6, 360), recon::Box{{0, 0, 0}, {0.1, 0.1, 0.2}});
  const std::string html = page.str();
  EXPECT_THAT(html, HasSubstr("from above"));
  EXPECT_THAT(html, HasSubstr("from the side"));
  for (int i = 0; i < 6; ++i) EXPECT_THAT(html, HasSubstr("CAM-" + std::to_string(i)));
  EXPECT_THAT(html, HasSubstr("316 mm"));  // between neighbours, one above and one below
  EXPECT_THAT(html, HasSubstr("y, m"));
  EXPECT_THAT(html, Not(HasSubstr("nan")));
}

TEST(CameraPlan, AboveIsWhereTheCamerasPicturesPoint) {
  // A calibrated world has y up the board: the plan then shows z and x.
  std::vector<PlanCamera> cameras = arc(4, 360);
  for (PlanCamera& camera : cameras) {
    camera.position = Eigen::Vector3d(camera.position.x(), camera.position.z(), camera.position.y());
    camera.direction = -camera.position;
    camera.up = -Eigen::Vector3d::UnitY();
  }
  const auto pictures = camera_plan_pictures(cameras, {});
  ASSERT_EQ(pictures.size(), 2U);
  EXPECT_THAT(pictures[0].html, HasSubstr(">z, m<"));
  EXPECT_THAT(pictures[0].html, HasSubstr(">x, m<"));
  EXPECT_THAT(pictures[1].html, HasSubstr(">y, m<"));
}

TEST(CameraPlan, OneCameraOrNoneIsNoFault) {
  HtmlPage page("plan");
  add_camera_plan(page, {}, {});
  EXPECT_THAT(page.str(), Not(HasSubstr("<svg")));
  add_camera_plan(page, {{"alone", {1, 2, 3}, {0, 0, 1}}}, {});
  EXPECT_THAT(page.str(), HasSubstr("alone"));
  EXPECT_THAT(page.str(), Not(testing::ContainsRegex("[^a-z]nan|[^a-z]inf[^a-z]")));
}

TEST(CameraPlan, CamerasOnOneSpotOfThePlanShareALabel) {
  const auto pictures = camera_plan_pictures({{"a", {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}},
                                              {"b", {1, 0, 0.5}, {-1, 0, 0}, {0, 0, 1}},
                                              {"c", {-1, 0, 0}, {1, 0, 0}, {0, 0, 1}}},
                                             {});
  EXPECT_THAT(pictures[0].html, HasSubstr(">0, 1<"));
  EXPECT_THAT(pictures[1].html, Not(HasSubstr(">0, 1<")));
}

}  // namespace
}  // namespace emberlock::report
