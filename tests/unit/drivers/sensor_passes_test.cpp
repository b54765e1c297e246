// SPDX-License-Identifier: Apache-2.0
// The passes that a scene lists are all that its pictures show.
#include <algorithm>
#include <memory>

#include <gtest/gtest.h>

#include "drivers/virtual/sensor.h"
#include "tests/support/virtual_cameras.h"

namespace emberlock::drivers {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

class Glow final : public LightField {
 public:
  explicit Glow(float level) : level_(level) {}
  void add_radiance(int, TimePoint, Seconds, std::span<float> rgb) const override {
    for (float& v : rgb) v += level_;
  }

 private:
  float level_;
};

struct PassCase {
  Pass pass;
  const char* name;
  void (*change)(VirtualScene&);  ///< the figures that this pass alone looks at
};

const PassCase kPasses[] = {
    {Pass::flame, "flame", [](VirtualScene& s) { s.flame = std::make_shared<Glow>(90.0F); }},
    {Pass::lamp, "lamp", [](VirtualScene&) {}},
    {Pass::bloom, "bloom",
     [](VirtualScene& s) { s.halo_level = 250, s.halo_length = 30, s.overflow_up = s.overflow_down = 40; }},
    {Pass::room, "room", [](VirtualScene& s) { s.room_share = 0.05; }},
    {Pass::smear, "smear", [](VirtualScene& s) { s.smear_leak = 0.9; }},
    {Pass::hot_pixels, "hot_pixels", [](VirtualScene& s) { s.hot_pixels = 5000; }},
    {Pass::shot_noise, "shot_noise", [](VirtualScene& s) { s.electrons_per_level = 0.1; }},
    {Pass::read_noise, "read_noise", [](VirtualScene& s) { s.read_noise = 90; }},
    {Pass::quantise, "quantise", [](VirtualScene& s) { s.adc_bits = 2; }},
};

VirtualScene full_scene() {
  VirtualScene scene;
  for (const PassCase& p : kPasses) scene.passes.push_back(p.pass);
  scene.flame = std::make_shared<Glow>(10.0F);
  return scene;
}

VirtualScene without(VirtualScene scene, Pass pass) {
  scene.passes.erase(std::remove(scene.passes.begin(), scene.passes.end(), pass), scene.passes.end());
  return scene;
}

/// One frame under a lamp lit in the exposure and a flash in the read phase.
Image expose(VirtualSensor& sensor, const VirtualScene& scene) {
  const LightPulse pulses[] = {{milliseconds(-20), microseconds(20)}, {milliseconds(10), microseconds(20)}};
  return sensor.expose(std::make_shared<VirtualScene>(scene), pulses, {7, TimePoint{}, milliseconds(41)});
}

class SensorPasses : public testing::TestWithParam<PassCase> {};

TEST_P(SensorPasses, OneThatIsNotListedLeavesNoTraceWhateverItsFigures) {
  const auto& [pass, name, change] = GetParam();
  const VirtualScene off = without(full_scene(), pass);
  VirtualScene changed = off;
  change(changed);
  VirtualSensor one(small_camera(), 0, 1);
  VirtualSensor other(small_camera(), 0, 1);
  EXPECT_EQ(expose(one, off), expose(other, changed));
  EXPECT_NE(expose(one, off), expose(other, full_scene())) << "what is on is seen";
}

TEST_P(SensorPasses, OneThatIsTakenOffTheListIsForgotten) {
  const VirtualScene off = without(full_scene(), GetParam().pass);
  VirtualSensor fresh(small_camera(), 0, 1);
  VirtualSensor used(small_camera(), 0, 1);
  (void)expose(used, full_scene());
  EXPECT_EQ(expose(used, off), expose(fresh, off));
  VirtualScene alone;
  alone.flame = full_scene().flame;
  alone.passes = {GetParam().pass};
  EXPECT_EQ(expose(used, alone), expose(fresh, alone));
}

/// The scene again, from each kind of sensor that has no smear.
TEST(SensorPasses, OfOtherSensorsOneThatIsNotListedLeavesNoTraceEither) {
  for (const SensorKind kind : {SensorKind::rolling_shutter, SensorKind::global_shutter}) {
    for (const PassCase& p : kPasses) {
      VirtualCameraOptions camera = small_camera();
      camera.sensor = kind;
      const VirtualScene off = without(full_scene(), p.pass);
      VirtualScene changed = off;
      p.change(changed);
      VirtualSensor one(camera, 0, 1);
      VirtualSensor other(camera, 0, 1);
      EXPECT_EQ(expose(one, off), expose(other, changed)) << p.name;
      const bool seen = expose(one, off) != expose(other, full_scene());
      EXPECT_EQ(seen, p.pass != Pass::smear) << p.name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Every, SensorPasses, testing::ValuesIn(kPasses),
                         [](const auto& p) { return std::string(p.param.name); });

TEST(SensorPasses, TheirOrderInTheListMeansNothing) {
  VirtualScene backwards = full_scene();
  std::reverse(backwards.passes.begin(), backwards.passes.end());
  VirtualSensor one(small_camera(), 0, 1);
  VirtualSensor other(small_camera(), 0, 1);
  EXPECT_EQ(expose(one, full_scene()), expose(other, backwards));
}

}  // namespace
}  // namespace emberlock::drivers
