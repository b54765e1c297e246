// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/motion.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "recon/adjust/choose_effects.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/prepared_scene.h"
#include "recon/adjust/solver.h"
#include "recon/synthetic/flame.h"
#include "tests/support/pictures.h"
#include "tests/support/small_flame.h"
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

constexpr double kReach = 5.4e-3;  // seconds

PaperSceneOptions smaller_film() {
  PaperSceneOptions options = small_film({128, 96}, 40);
  options.flame.seed = 3;
  return options;
}

/// Filmed by cameras up to 5.4 ms apart, whose averages are known.
Scene late_scene(double rise_speed) {
  PaperSceneOptions options = smaller_film();
  options.flame.rise_speed = rise_speed;
  options.averaged_frames = 8;
  for (std::uint64_t i = 0; i < 10; ++i)
    options.lateness.push_back(Seconds(kReach * (2 * random_uniform(7, 0, i) - 1)));
  return paper_scene(options);
}

const Scene& rising_scene() {
  static const Scene scene = late_scene(1);
  return scene;
}

EffectChoice chosen(const Scene& scene, const EffectRequest& request = {}) {
  const EffectChoice choice = value_of(choose_effects(scene, grid_over(scene.box, 40), request, {}));
  EXPECT_EQ(choice.reports.back().name, "motion");
  return choice;
}

double heldout(const Scene& scene, const Effects& effects) {
  return held_out_error(solved_on(scene, 40, effects));
}

Motion rising(double speed) { return {Motion::Carry::uniform, {0, 0, speed}}; }

/// Eleven cameras whose instants are spread over a 24th of a second film a flame that rises at 1 m/s; each
/// brings the picture that is nearest to this part of the period.
Scene staggered_scene(double part) {
  constexpr int kCameras = 11;
  const Seconds period(1 / 24.0);
  PaperSceneOptions options = smaller_film();
  options.flame.rise_speed = 1;
  options.cameras = kCameras;
  options.averaged_frames = 8;
  options.time = part * period;
  for (int i = 0; i < kCameras; ++i)
    options.lateness.push_back(wrap_symmetric(period * (4 * i % kCameras / 11.0 - part), period));
  return paper_scene(options);
}

TEST(MotionTestSlow, StaggeredCamerasSeeBetweenTheirInstantsAsWellAsAtThem) {
  Effects moving = absorbing(PerMeter(32.8));
  Effects still = moving;
  moving.motion = rising(1);
  double at = 0;
  double between = 0;
  double unaware = 0;
  for (const int i : {0, 6}) {
    at += heldout(staggered_scene(i / 11.0), moving);
    const Scene scene = staggered_scene((i + 0.5) / 11.0);
    between += heldout(scene, moving);
    unaware += heldout(scene, still);
  }
  EXPECT_LE(between, 1.2 * at);
  EXPECT_LT(between, 0.7 * unaware) << "pictures of other instants as if they were of this one";
}

TEST(MotionTest, APictureOfAFlameThatHasLeftTheBoxIsRefused) {
  Scene scene;
  scene.box.size = Eigen::Vector3d(0.1, 0.1, 0.3);
  for (const double late : {0.0, 0.02, -0.02}) {
    scene.views.emplace_back().name = "late";
    scene.views.back().lateness = Seconds(late);
  }
  EXPECT_TRUE(check_carried(scene, {}).ok());
  EXPECT_TRUE(check_carried(scene, rising(7.4)).ok());
  EXPECT_EQ(check_carried(scene, rising(7.6)).error().kind, ErrorKind::refused);
  EXPECT_FALSE(check_carried(scene, {Motion::Carry::uniform, {6, 6, 0}}).ok());
  for (View& view : scene.views) view.lateness = Seconds(0);
  EXPECT_TRUE(check_carried(scene, rising(100)).ok());
}

TEST(MotionTest, AMovedCameraSeesTheCarriedPointWhereItsOwnSawItLate) {
  View view;
  view.camera =
      look_at({{64, 48}, 80, 80, 32, 24, {0.1, -0.02, 0.001, 0.002, 0}}, {0.3, 0.1, 0.05}, {0, 0, 0});
  view.lateness = Seconds(-0.004);
  const Motion motion{Motion::Carry::uniform, {0.2, -0.3, 1.5}};
  const Eigen::Vector3d at_instant(0.01, -0.02, 0.03);
  const Eigen::Vector3d when_filmed = at_instant - 0.004 * Eigen::Vector3d(0.2, -0.3, 1.5);
  EXPECT_LT((camera_at_instant(view, motion).project(at_instant) - view.camera.project(when_filmed)).norm(),
            1e-9);
}

TEST(MotionTest, APictureOfThePlaneThroughTheFlameChangesPlaceAsTheCameraDoes) {
  // A smooth spot in the plane across the axis, seen from both places.
  View view;
  view.camera = look_at({{64, 48}, 80, 80, 32, 24, {}}, {0, -0.4, 0}, {0, 0, 0});
  view.lateness = Seconds(0.005);
  const Motion motion = rising(2);
  const auto picture = [&](const CameraModel& camera) {
    return radiance_of({64, 48}, [&](int x, int y, int /*c*/) {
      const Ray ray = camera.ray({x + 0.5, y + 0.5});
      const Eigen::Vector3d point = ray.origin - ray.origin.y() / ray.direction.y() * ray.direction;
      return 100 * std::exp(-point.squaredNorm() / (2 * 0.03 * 0.03));
    });
  };
  const RadianceImage own = picture(view.camera);
  const RadianceImage moved = picture(camera_at_instant(view, motion));
  const RadianceImage change = change_of_place(own, view, motion, Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < own.rgb.size(); ++i) EXPECT_NEAR(change.rgb[i], own.rgb[i] - moved.rgb[i], 0.6);
}

TEST(MotionTestSlow, AViewFromAnotherInstantIsRenderedAtItsOwn) {
  const Scene& scene = rising_scene();
  const EffectChoice choice = chosen(scene);
  ASSERT_TRUE(choice.reports.back().on) << choice.reports.back().reason;
  EXPECT_NEAR(choice.effects.motion.velocity[2], 1, 0.3);
  EXPECT_LT(std::hypot(choice.effects.motion.velocity[0], choice.effects.motion.velocity[1]), 0.3);
  Effects still = choice.effects;
  still.motion = {};
  const double corrected = heldout(scene, choice.effects);
  EXPECT_LT(corrected, 0.8 * heldout(scene, still));
}

TEST(MotionTestSlow, AFlameThatStandsStillAndOneFilmedAtOnceAreLeftAlone) {
  const EffectChoice standing = chosen(late_scene(0));
  EXPECT_FALSE(standing.reports.back().on) << standing.reports.back().reason;
  EXPECT_EQ(standing.effects.motion.carry, Motion::Carry::none);

  const Scene at_once = paper_scene(smaller_film());
  const EffectChoice choice = chosen(at_once);
  EXPECT_FALSE(choice.reports.back().on);
  EXPECT_EQ(choice.reports.back().predicted_change, 0);
  EXPECT_EQ(choice.reports.back().seconds, Seconds(0));
  Effects asked;
  asked.motion = rising(1);
  EXPECT_EQ(PreparedScene::create(at_once, asked)->scene().views[0].image, at_once.views[0].image)
      << "nothing is copied where no view is late";
}

TEST(MotionTestSlow, TimesThatAreAsUncertainAsTheyDifferAreNotUsed) {
  Scene scene = rising_scene();
  for (View& view : scene.views) view.lateness_sigma = Seconds(kReach);
  const EffectChoice choice = chosen(scene);
  EXPECT_FALSE(choice.reports.back().on) << choice.reports.back().reason;
}

TEST(MotionTestSlow, WhatIsSetByHandIsTaken) {
  const auto request = value_of(parse_effects("extinction=32.8,motion=0.8"));
  EXPECT_EQ(request.fixed->motion.velocity, (std::array<double, 3>{0, 0, 0.8}));
  EXPECT_EQ(parse_effects("motion=0.1/-0.2/0.9")->fixed->motion.velocity,
            (std::array<double, 3>{0.1, -0.2, 0.9}));
  EXPECT_EQ(parse_effects("motion=none")->fixed->motion.carry, Motion::Carry::none);
  for (const char* wrong : {"motion=fast", "motion=1/2", "motion=21", "motion=0/0/nan"})
    EXPECT_FALSE(parse_effects(wrong).ok()) << wrong;
  const EffectChoice choice = chosen(rising_scene(), request);
  EXPECT_TRUE(choice.reports.back().on);
  EXPECT_GT(choice.reports.back().predicted_change, 1);
  EXPECT_EQ(choice.effects.motion.velocity[2], 0.8);
}

/// A held-out view that is late too is rendered at its own instant: what is taken out of its picture is put
/// into the render.
TEST(MotionTest, TheSteadyPartGoesBackIntoARenderOfALateView) {
  const Scene& scene = rising_scene();
  Effects effects;
  effects.motion = rising(1);
  const auto prepared = value_of(PreparedScene::create(scene, effects));
  const RadianceImage& at_instant = *prepared.scene().views[0].image;
  RadianceImage render = at_instant;
  prepared.at_own_instant(render, 0);
  double worst = 0;
  for (std::size_t i = 0; i < render.rgb.size(); ++i)
    if (at_instant.rgb[i] > 0)  // elsewhere black has clipped it
      worst = std::max(worst, static_cast<double>(std::abs(render.rgb[i] - scene.views[0].image->rgb[i])));
  EXPECT_LT(worst, 1e-3);
}

}  // namespace
}  // namespace emberlock::recon
