// SPDX-License-Identifier: Apache-2.0
// What flashes leave in the pictures of rolling and global shutters, by their definitions.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/virtual/sensor.h"
#include "tests/support/virtual_cameras.h"

namespace emberlock::drivers {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)
using testing::HasSubstr;

constexpr double kRow = 250e-6;  // of small_camera()

VirtualCameraOptions camera(SensorKind kind, Seconds exposure, smear::ReadDirection direction) {
  VirtualCameraOptions c = small_camera(direction);
  c.sensor = kind;
  c.exposure = exposure;
  return c;
}

VirtualScene room() {
  VirtualScene scene;
  scene.passes = {Pass::room};
  scene.room_share = 0.015;
  return scene;
}

/// Parts of a flash that every row shows, 0..1, top to bottom: by a picture beside the lamp against one of a
/// global shutter that holds all of the flash.
std::vector<double> parts(const VirtualCameraOptions& options, Seconds exposure, LightPulse flash) {
  const auto scene = std::make_shared<const VirtualScene>(room());
  VirtualCameraOptions all = options;
  all.sensor = SensorKind::global_shutter;
  VirtualSensor sensor(options, 0, 1);
  VirtualSensor whole(all, 0, 1);
  const LightPulse inside[] = {{milliseconds(-10), microseconds(20)}};
  const Image one = sensor.expose(scene, {&flash, 1}, {0, TimePoint{}, exposure});
  const Image full = whole.expose(scene, inside, {0, TimePoint{}, milliseconds(20)});
  std::vector<double> part;
  const double dark = std::round(scene->background / 255 * 4095);
  for (int y = 0; y < options.layout.size.height; ++y)
    part.push_back((one.view().sample(40, y) - dark) / (full.view().sample(40, y) - dark));
  return part;
}

TEST(RollingShutter, AFlashLightsTheRowsThatAreExposedThen) {
  for (const auto direction : {smear::ReadDirection::top_first, smear::ReadDirection::bottom_first}) {
    for (const double exposure : {2e-3, 7e-3}) {
      for (const double begin : {0.0031, 0.0249, -0.0011}) {
        const auto options = camera(SensorKind::rolling_shutter, Seconds(exposure), direction);
        const auto part = parts(options, Seconds(exposure), {Seconds(begin), microseconds(20)});
        for (int y = 0; y < 120; ++y) {
          const int order = direction == smear::ReadDirection::top_first ? y : 119 - y;
          const double end = order * kRow;
          const double lit =
              std::clamp((std::min(begin + 20e-6, end) - std::max(begin, end - exposure)) / 20e-6, 0.0, 1.0);
          ASSERT_NEAR(part[static_cast<std::size_t>(y)], lit, 0.01) << y << " " << exposure << " " << begin;
        }
      }
    }
  }
}

TEST(RollingShutter, TheLampShowsInItsLitRowsOnly) {
  const auto options =
      camera(SensorKind::rolling_shutter, milliseconds(0.5), smear::ReadDirection::top_first);
  VirtualScene scene;
  scene.passes = {Pass::lamp, Pass::bloom, Pass::smear};
  scene.background = 0;
  VirtualSensor sensor(options, 0, 1);
  // Rows 50 and 51 are exposed, through the lamp's middle: no light elsewhere, and no smear.
  const LightPulse flash{Rows(49.5) * SecondsPerRow(kRow), microseconds(20)};
  const Image picture = sensor.expose(std::make_shared<const VirtualScene>(scene), {&flash, 1},
                                      {0, TimePoint{}, milliseconds(0.5)});
  for (int y = 0; y < 120; ++y) {
    const bool lit = y == 50 || y == 51;
    EXPECT_EQ(picture.view().sample(30, y), lit ? 4095 : 0) << y;
  }
}

TEST(GlobalShutter, TheFlashsShareInsideTheWindowScalesTheBrightness) {
  const Seconds exposure = milliseconds(3);
  const auto options = camera(SensorKind::global_shutter, exposure, smear::ReadDirection::top_first);
  for (const auto& [begin_us, share] : {std::pair{-1000.0, 1.0},
                                        {-3000.0, 1.0},
                                        {-3005.0, 0.75},
                                        {-3020.0, 0.0},
                                        {-5.0, 0.25},
                                        {0.0, 0.0},
                                        {9000.0, 0.0}}) {
    const auto part = parts(options, exposure, {microseconds(begin_us), microseconds(20)});
    for (const double p : part) ASSERT_NEAR(p, share, 0.02) << begin_us;
  }
}

TEST(GlobalShutter, LeavesNoSmear) {
  const auto rig = small_rig(
      {camera(SensorKind::global_shutter, milliseconds(30), smear::ReadDirection::top_first)}, {Pass::smear});
  ASSERT_TRUE(rig->strobe().apply({.output = StrobeOutput::flashing, .rate = Hertz(24)}).ok());
  ASSERT_TRUE(rig->camera(0).start().ok());
  const Frame frame = rig->camera(0).next_frame(Seconds(1)).value();
  for (int y = 0; y < 120; ++y)
    EXPECT_EQ(frame.image->view().sample(30, y), frame.image->view().sample(5, 5));
  EXPECT_TRUE(rig->dots(0, 0).empty());
}

TEST(Shutters, EachCamerasOwnExposureGoesBeforeTheScenes) {
  auto scene = room();
  scene.exposure = milliseconds(1);
  VirtualRigOptions setup;
  setup.scene = scene;
  setup.cameras = {camera(SensorKind::global_shutter, milliseconds(30), smear::ReadDirection::top_first),
                   camera(SensorKind::global_shutter, milliseconds(30), smear::ReadDirection::top_first)};
  setup.cameras[1].id = "of-the-scene";
  setup.cameras[1].exposure.reset();
  auto rig = VirtualRig::create(setup, std::make_shared<VirtualClock>()).value();
  // A flash 20 ms before the read phases of both, which begin at whole periods.
  ASSERT_TRUE(
      rig->strobe()
          .apply({.output = StrobeOutput::flashing, .rate = Hertz(24), .phase = Seconds(1 / 24.0 - 0.02)})
          .ok());
  int light[2];
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(rig->camera(i).start().ok());
    light[i] = rig->camera(i).next_frame(Seconds(1)).value().image->view().sample(30, 50);
  }
  EXPECT_GT(light[0], 500);
  EXPECT_LT(light[1], 100);
}

TEST(Shutters, AnExposureThatDoesNotFitNamesTheCamera) {
  VirtualRigOptions setup;
  setup.cameras = {camera(SensorKind::global_shutter, milliseconds(50), smear::ReadDirection::top_first)};
  const Status refused = check(setup);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message(), HasSubstr("virtual-00"));
  EXPECT_THAT(refused.error().message(), HasSubstr("exposure"));
}

TEST(Shutters, ARigsNameTellsHowManyOfEachKind) {
  const auto rig = parse_virtual_rig("virtual:2ccd+3rolling+1global");
  ASSERT_TRUE(rig.ok()) << rig.error().message();
  ASSERT_EQ(rig->cameras.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(rig->cameras[i].sensor, i < 2   ? SensorKind::ccd
                                      : i < 5 ? SensorKind::rolling_shutter
                                              : SensorKind::global_shutter);
    EXPECT_EQ(rig->cameras[i].exposure.has_value(), i >= 2);
  }
  EXPECT_TRUE(rig->scene.has(Pass::room));
  EXPECT_FALSE(parse_virtual_rig("virtual:6")->scene.has(Pass::room)) << "nobody needs it";
  for (const char* odd : {"virtual:", "virtual:2+", "virtual:+2", "virtual:2cmos", "virtual:60ccd+5global",
                          "virtual:1+2147483647ccd"}) {
    const auto refused = parse_virtual_rig(odd);
    ASSERT_FALSE(refused.ok()) << odd;
    EXPECT_THAT(refused.error().message(), HasSubstr("4ccd+3rolling+2global"));
  }
}

}  // namespace
}  // namespace emberlock::drivers
