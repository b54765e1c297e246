// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "recon/effects/effects.h"
#include "recon/preprocess/flame_mask.h"
#include "recon/preprocess/view.h"

namespace emberlock::recon {

/// The views as a solver works on them: linear in light, and all of the scene's instant. Copies them only
/// where the sensor isn't linear, or late views move.
class PreparedScene {
 public:
  /// The scene must outlive it.
  PreparedScene(const Scene& scene, const Effects& effects);
  PreparedScene(PreparedScene&&) = delete;
  PreparedScene& operator=(PreparedScene&&) = delete;
  [[nodiscard]] const Scene& scene() const { return copy_ ? *copy_ : scene_; }

 private:
  const Scene& scene_;
  std::optional<Scene> copy_;
};

/// A render by the prepared scene's camera of view `i` as the view itself was filmed: at its own instant.
void at_own_instant(RadianceImage& render, const Scene& scene, std::size_t i, const Effects& effects);

/// flame_masks() of what stands out from the background, brighter or darker.
std::vector<FlameMask> masks_before(const Scene& scene, const Background& background,
                                    std::optional<double> threshold = std::nullopt);

}  // namespace emberlock::recon
