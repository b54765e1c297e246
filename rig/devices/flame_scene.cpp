// SPDX-License-Identifier: Apache-2.0
#include "rig/devices/flame_scene.h"

#include "rig/devices/stage.h"

namespace emberlock::rig {

std::shared_ptr<const drivers::LightField> still_flame(int cameras, ImageSize size) {
  constexpr int kTruthVoxels = 64;
  const Stage stage = demo_stage(cameras, size);
  return std::make_shared<StillFlame>(FlameLight(stage, {}, kTruthVoxels), stage, TimePoint{});
}

}  // namespace emberlock::rig
