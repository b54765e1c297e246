// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/scene.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace emberlock::drivers {

bool VirtualScene::has(Pass pass) const {
  return std::find(passes.begin(), passes.end(), pass) != passes.end();
}

Status check(const VirtualScene& scene) {
  struct Field {
    const char* name;
    double value, low, high;
  };
  const Field fields[] = {
      {"exposure", scene.exposure.value(), 0, 3600},
      {"background", scene.background, 0, 255},
      {"flash_level", scene.flash_level, 0, 1e9},
      {"steady_rate", scene.steady_rate, 0, 1e12},
      {"room_share", scene.room_share, 0, 1},
      {"smear_leak", scene.smear_leak, 0, 1},
      {"halo_level", scene.halo_level, 0, 255},
      {"halo_length", scene.halo_length, 0.1, 100},
      {"overflow_up", scene.overflow_up, 0, 1000},
      {"overflow_down", scene.overflow_down, 0, 1000},
      {"hot_pixels", static_cast<double>(scene.hot_pixels), 0, 1e6},
      {"electrons_per_level", scene.electrons_per_level, 0.01, 1e6},
      {"read_noise", scene.read_noise, 0, 255},
      {"adc_bits", static_cast<double>(scene.adc_bits), 1, 16},
  };
  for (const Field& f : fields) {
    if (!(f.value >= f.low && f.value <= f.high)) {
      return Error{ErrorKind::bad_input, std::string(f.name) + " is " + std::to_string(f.value),
                   "virtual scene",
                   "give a value from " + std::to_string(f.low) + " to " + std::to_string(f.high)};
    }
  }
  if (scene.has(Pass::flame) && !scene.flame) {
    return Error{ErrorKind::bad_input, "the pass flame is listed, but there is no flame", "virtual scene",
                 "set `flame` to a LightField, or leave the pass out"};
  }
  return {};
}

VirtualScene smear_scene() {
  VirtualScene scene;
  scene.passes = {Pass::lamp, Pass::bloom, Pass::smear, Pass::hot_pixels, Pass::shot_noise, Pass::read_noise};
  return scene;
}

VirtualScene lit_room_scene() {
  VirtualScene scene = smear_scene();
  scene.passes.push_back(Pass::room);
  return scene;
}

VirtualScene flame_scene(std::shared_ptr<const LightField> flame) {
  VirtualScene scene;
  scene.passes = {Pass::flame, Pass::shot_noise, Pass::read_noise};
  scene.exposure = milliseconds(1);
  scene.background = 0;
  scene.flame = std::move(flame);
  return scene;
}

}  // namespace emberlock::drivers
