#include "daemon/devices/flame_scene.h"

#include "daemon/devices/stage.h"

namespace emberlock {

std::shared_ptr<const LightField> still_flame(int cameras, ImageSize size) {
  constexpr int kTruthVoxels = 64;
  const Stage stage = demo_stage(cameras, size);
  return std::make_shared<StillFlame>(FlameLight(stage, {}, kTruthVoxels), stage, TimePoint{});
}

}  // namespace emberlock
