#pragma once

#include <optional>
#include <vector>

#include "recon/effects/effects.h"
#include "recon/preprocess/flame_mask.h"
#include "recon/preprocess/view.h"

namespace emberlock {

/// The views as a solver works on them: linear in light. Copies them only where the sensor isn't linear.
class PreparedScene {
 public:
  /// The scene must outlive it.
  PreparedScene(const Scene& scene, const Sensor& sensor);
  PreparedScene(PreparedScene&&) = delete;
  PreparedScene& operator=(PreparedScene&&) = delete;
  [[nodiscard]] const Scene& scene() const { return linear_ ? *linear_ : scene_; }

 private:
  const Scene& scene_;
  std::optional<Scene> linear_;
};

/// flame_masks() of what stands out from the background, brighter or darker.
std::vector<FlameMask> masks_before(const Scene& scene, const Background& background,
                                    std::optional<double> threshold = std::nullopt);

}  // namespace emberlock
