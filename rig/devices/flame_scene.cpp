// SPDX-License-Identifier: Apache-2.0
#include "rig/devices/flame_scene.h"

#include <utility>
#include <vector>

#include "rig/devices/stage.h"

namespace emberlock::rig {

std::shared_ptr<const drivers::LightField> still_flame(int cameras, ImageSize size) {
  constexpr int kTruthVoxels = 64;
  const Stage stage = demo_stage(cameras, size);
  return std::make_shared<StillFlame>(FlameLight(stage, {}, kTruthVoxels), stage, TimePoint{});
}

drivers::VirtualScene flame_and_strobe(std::shared_ptr<const drivers::LightField> flame,
                                       const drivers::VirtualScene& room) {
  drivers::VirtualScene scene = room;
  const drivers::VirtualScene alone = drivers::flame_scene(std::move(flame));
  scene.passes.push_back(drivers::Pass::flame);
  std::erase(scene.passes, drivers::Pass::hot_pixels);  // of a flame's picture they would be part
  scene.exposure = alone.exposure;
  scene.background = alone.background;
  scene.flame = alone.flame;
  return scene;
}

}  // namespace emberlock::rig
