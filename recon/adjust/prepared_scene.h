// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "base/result.h"
#include "recon/compute/device.h"
#include "recon/effects/effects.h"
#include "recon/views/flame_mask.h"
#include "recon/views/view.h"

namespace emberlock::recon {

using SharedMasks = std::shared_ptr<const std::vector<FlameMask>>;

/// A scene that has passed check_scene(), and its views as a solver works on them under some effects: linear
/// in light, and all of the scene's instant. Pictures that come out as they were are shared with the scene as
/// told; what the sensor bends is made linear once, also for whoever asks for the same sensor later.
class PreparedScene {
 public:
  /// Errors: those of check_scene().
  static Result<PreparedScene> create(Scene told, const Effects& effects);
  /// The same scene under other effects. Of what both have in common no pixels are copied.
  [[nodiscard]] PreparedScene under(const Effects& effects) const;
  /// The same scene through other cameras, one a view, that take pictures of the same size.
  [[nodiscard]] PreparedScene through(const std::vector<CameraModel>& cameras) const;

  /// The same scene with the role `left_out` for these views.
  [[nodiscard]] PreparedScene without(const std::vector<std::size_t>& views) const;

  [[nodiscard]] const Scene& scene() const { return prepared_; }
  /// Pictures as filmed, cameras as put right by through().
  [[nodiscard]] const Scene& told() const { return told_; }
  [[nodiscard]] const Effects& effects() const { return effects_; }
  /// Of scene(), in front of the background. Noise masks are found when they are first asked for, once for
  /// all scenes of the same pictures and background.
  [[nodiscard]] SharedMasks masks(std::optional<double> threshold, const ComputeOptions& compute) const;
  /// Makes of a render by scene()'s camera of view `i` what the view itself shows: at its own instant.
  void at_own_instant(RadianceImage& render, std::size_t i) const;

 private:
  PreparedScene(Scene told, const Effects& effects);
  void make_linear();
  void bring_together();

  struct NoiseMasks {
    std::once_flag once;
    SharedMasks found;
  };

  Scene told_;
  Effects effects_;
  Scene linear_;    // as filmed, linear in light
  Scene prepared_;  // and of one instant
  std::shared_ptr<NoiseMasks> noise_masks_ = std::make_shared<NoiseMasks>();
};

/// What stands out from the background, brighter or darker; the picture itself where that is black.
SharedImage before_background(const View& view, const Background& background);

/// flame_masks() of what stands out from the background; without a threshold each view's own noise_mask.
std::vector<FlameMask> masks_before(const Scene& scene, const Background& background,
                                    std::optional<double> threshold, const ComputeOptions& compute);

}  // namespace emberlock::recon
