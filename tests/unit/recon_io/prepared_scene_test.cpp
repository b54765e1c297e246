// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/prepared_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "recon/adjust/choose_effects.h"
#include "recon/effects/sensor.h"
#include "recon/pipeline/reconstruct.h"
#include "tests/support/ball_scene.h"
#include "tests/support/count_allocations.h"
#include "tests/support/counting_clock.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

constexpr int kViewsOfABall = 7;  // one of them held out

Scene scene_of_a_ball() {
  BallOptions options;
  options.views = kViewsOfABall - 1;
  options.image = {320, 240};
  return ball_scene(options);
}

Effects a_gamma() {
  Effects effects;
  effects.sensor.response = Sensor::Response::gamma;
  effects.sensor.gamma = 1.8;
  return effects;
}

Motion rising_fast() { return {Motion::Carry::uniform, {0, 0, 3}}; }

/// Of the views' size, in a reconstruction from the scene in memory to the views rendered; and its warnings.
int pictures_made(const Scene& scene, const std::optional<EffectRequest>& effects,
                  std::vector<std::string>* warnings = nullptr) {
  ReconstructOptions options;
  options.voxels = 16;
  options.effects = effects;
  options.solve.iterations = 2;
  options.solve.compute.device = Device::cpu;
  options.solve.compute.threads = 2;
  return allocations_of(scene.views[0].image->rgb.size() * sizeof(float), [&] {
    const auto outcome = value_of(reconstruct(scene, options, test::CountingClock()));
    if (warnings != nullptr) *warnings = outcome.report.warnings;
  });
}

/// Each view is rendered with the volume and without any light.
constexpr int kRenders = 2 * kViewsOfABall;

TEST(PreparedSceneTestSlow, AReconstructionOfLinearPicturesMakesNoneButItsRenders) {
  EXPECT_EQ(pictures_made(scene_of_a_ball(), EffectRequest{Effects{}}), kRenders);
  EXPECT_EQ(pictures_made(scene_of_a_ball(), {}), kRenders) << "nor does the search for effects";
}

TEST(PreparedSceneTestSlow, AReconstructionMakesPicturesLinearOnce) {
  EXPECT_EQ(pictures_made(scene_of_a_ball(), EffectRequest{a_gamma()}), kViewsOfABall + kRenders);
}

TEST(PreparedSceneTestSlow, ACameraThatIsPutRightCostsNoPictures) {
  Scene scene = scene_of_a_ball();
  scene.views[2].camera.intrinsics.cy += 30;
  std::vector<std::string> warnings;
  EXPECT_EQ(pictures_made(scene, EffectRequest{Effects{}}, &warnings), kRenders);
  EXPECT_THAT(warnings, testing::Contains(testing::HasSubstr("was put right")));
}

// What is measured along the borders is light, as the background of a render is.
TEST(PreparedSceneTest, AGreyBackgroundBehindAGammaIsKnownInLinearLevels) {
  Scene scene = scene_of_a_ball();
  const Effects bent = a_gamma();
  for (View& view : scene.views) {
    RadianceImage picture = *view.image;
    for (float& value : picture.rgb) value += 12;
    respond(picture, bent.sensor);
    view.image = share(std::move(picture));
  }
  const auto filmed = value_of(PreparedScene::create(scene, {}));
  EffectRequest request;
  request.assumed.sensor.gamma = bent.sensor.gamma;
  const Background found = under_known_effects(filmed, request).effects().background;
  EXPECT_EQ(found.kind, Background::Kind::constant);
  for (const double level : found.radiance) EXPECT_NEAR(level, 12, 0.5);
}

TEST(PreparedSceneTest, MasksAreFoundOnceForTheSamePicturesAndBackground) {
  const auto prepared = value_of(PreparedScene::create(scene_of_a_ball(), {}));
  const SharedMasks masks = prepared.masks({}, {});
  Effects other;
  other.extinction = constant_extinction(PerMeter(30));
  EXPECT_EQ(prepared.under(other).masks({}, {}), masks);
  other.background = {Background::Kind::constant, {9, 9, 9}};
  EXPECT_NE(prepared.under(other).masks({}, {}), masks);
  EXPECT_NE(prepared.under(a_gamma()).masks({}, {}), masks);
  const SharedMasks at_threshold = prepared.masks(50, {});
  EXPECT_EQ((*at_threshold)[0].threshold, 50);
  EXPECT_EQ(prepared.masks({}, {}), masks);
}

TEST(PreparedSceneTest, WhatDoesNotChangeAPictureSharesIt) {
  const Scene told = scene_of_a_ball();
  const auto prepared = value_of(PreparedScene::create(told, a_gamma()));
  const SharedImage linear = prepared.scene().views[1].image;
  EXPECT_NE(linear, told.views[1].image);
  EXPECT_EQ(prepared.told().views[1].image, told.views[1].image);

  Effects thick = a_gamma();
  thick.extinction = constant_extinction(PerMeter(30));
  EXPECT_EQ(prepared.under(thick).scene().views[1].image, linear);
  EXPECT_EQ(prepared.under(Effects{}).scene().views[1].image, told.views[1].image);

  std::vector<CameraModel> cameras;
  for (const View& view : told.views) cameras.push_back(view.camera);
  cameras[1].intrinsics.cx += 5;
  const PreparedScene turned = prepared.through(cameras);
  EXPECT_EQ(turned.scene().views[1].image, linear);
  EXPECT_EQ(turned.scene().views[1].camera.intrinsics.cx, cameras[1].intrinsics.cx);
  EXPECT_EQ(turned.told().views[1].camera.intrinsics.cx, cameras[1].intrinsics.cx);
}

TEST(PreparedSceneTest, OnlyLateViewsWhoseAverageIsKnownGetOtherPictures) {
  Scene told = scene_of_a_ball();
  for (View& view : told.views) view.average = view.image;
  told.views[2].lateness = Seconds(0.004);
  told.views[3].lateness = Seconds(0.004);
  told.views[3].average.reset();
  Effects moved;
  moved.motion = rising_fast();
  const auto prepared = value_of(PreparedScene::create(told, moved));
  const std::vector<View>& views = prepared.scene().views;
  EXPECT_EQ(views[1].image, told.views[1].image);
  EXPECT_NE(views[2].image, told.views[2].image);
  EXPECT_EQ(views[3].image, told.views[3].image);
  EXPECT_NE(views[3].camera.camera_from_world.translation,
            told.views[3].camera.camera_from_world.translation);
  EXPECT_EQ(prepared.under(moved).scene().views[2].image, views[2].image) << "done before";
}

TEST(PreparedSceneTest, ASceneThatNobodyCanUseIsNotPrepared) {
  Scene scene = scene_of_a_ball();
  scene.views[4].image.reset();
  EXPECT_EQ(PreparedScene::create(scene, {}).error().where, "camera 4");
}

}  // namespace
}  // namespace emberlock::recon
