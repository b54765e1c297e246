// SPDX-License-Identifier: Apache-2.0
#include "apply/scene_file.h"

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "tests/fuzz/target.h"

// A scene file: what is read from it is finite and in its range; what isn't has an error that says where.
FUZZ_TARGET(scene_file) {
  using namespace emberlock;
  const auto scene = apply::parse_scene({reinterpret_cast<const char*>(data), size}, "fuzz.json", "fuzz");
  if (!scene) {
    if (scene.error().where.empty() || scene.error().kind != ErrorKind::bad_input) std::abort();
    return 0;
  }
  if (scene->flames.empty()) std::abort();
  for (const apply::PlacedResult& flame : scene->flames) {
    const apply::Placement& place = flame.world_from_flame;
    if (!place.rotation.allFinite() || !place.translation.allFinite() || !(place.scale > 0)) std::abort();
    if (!(flame.rate.value() > 0) || !(flame.brightness >= 0) || !std::isfinite(flame.shift.value()))
      std::abort();
  }
  for (const apply::CameraPlan::Stop& stop : scene->camera.stops)
    if (!((stop.at - stop.from).norm() > 0)) std::abort();
  return 0;
}
