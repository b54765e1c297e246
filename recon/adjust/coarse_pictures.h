// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/render/render.h"
#include "recon/views/flame_mask.h"

namespace emberlock::recon {

/// A scene with a rough estimate of its flame.
struct CoarseFlame {
  const Scene& scene;
  const std::vector<FlameMask>& masks;  ///< one per view
  const Volume& volume;  ///< about 64 voxels along the longest edge: predicts the effects' changes
  const Hull& medium;    ///< on the volume's grid
  double finer =
      1;  ///< voxel edges of the reconstruction's grid per edge of this volume, for predicted costs
};

/// Each view's flame box; the whole picture if its mask is empty.
std::vector<PixelBox> flame_boxes(const Scene& scene, const std::vector<FlameMask>& masks);

/// Rendered pictures of a coarse flame for the input views: their flame boxes at every stride-th pixel, about
/// `pixels` in all. Sufficient to measure the change by an effect, in a hundredth of the time of full
/// pictures.
class CoarsePictures {
 public:
  CoarsePictures(const CoarseFlame& flame, const ComputeOptions& compute, int pixels = 20000);

  /// One picture per view. `options` may provide the scattered light and the gas.
  [[nodiscard]] std::vector<RadianceImage> operator()(const Effects& effects,
                                                      RenderOptions options = {}) const;

  /// The flame, cropped to its medium.
  [[nodiscard]] const Volume& volume() const { return volume_; }
  [[nodiscard]] const Hull& medium() const { return medium_; }
  [[nodiscard]] int stride() const { return stride_; }

 private:
  ComputeOptions compute_;
  Volume volume_;
  Hull medium_;
  int stride_ = 1;
  std::vector<CameraModel> cameras_;
  std::vector<RadianceImage> backgrounds_;  ///< with size 0 for views without one
};

/// RMS difference of two sets of pictures over all channels, after scaling the second set by the best gain;
/// the mean square is taken over each picture, then over the pictures. 0 if the second set is black.
double change(const std::vector<RadianceImage>& with, const std::vector<RadianceImage>& without);

}  // namespace emberlock::recon
