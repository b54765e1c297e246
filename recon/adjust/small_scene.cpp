// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/small_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "recon/views/shrink.h"

namespace emberlock::recon {
Scene small_scene(const Scene& scene, const std::vector<FlameMask>& masks, double pixels_looked_at) {
  double pixels = 0;
  int narrowest = std::numeric_limits<int>::max();
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].role != ViewRole::input) continue;
    const PixelBox& box = masks[v].box;
    pixels += static_cast<double>(box.x1 - box.x0) * (box.y1 - box.y0);
    narrowest = std::min({narrowest, scene.views[v].image->size.width, scene.views[v].image->size.height});
  }
  const int factor =
      std::clamp(static_cast<int>(std::lround(std::sqrt(pixels / pixels_looked_at))), 1, narrowest);
  Scene small;
  small.box = scene.box;
  for (const View& view : scene.views)
    if (view.role == ViewRole::input) small.views.push_back(shrunk(view, factor));
  return small;
}

}  // namespace emberlock::recon
