// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/preprocess/flame_mask.h"
#include "recon/render/render.h"

namespace emberlock::recon {

/// A scene whose flame is known roughly.
struct CoarseFlame {
  const Scene& scene;
  const std::vector<FlameMask>& masks;  ///< one a view
  const Volume& volume;                 ///< some 64 voxels along: it predicts what effects change
  const Hull& medium;                   ///< on the volume's grid
  double finer = 1;  ///< voxel edges of the reconstruction's grid in one of the volume's, for its costs
};

/// Each view's flame box, the whole picture where its mask is empty.
std::vector<PixelBox> flame_boxes(const Scene& scene, const std::vector<FlameMask>& masks);

/// What the input views show of a coarse flame: their flame boxes at every stride-th pixel, about `pixels` in
/// all. Enough for what an effect changes, at a hundredth of the time of full pictures.
class CoarsePictures {
 public:
  CoarsePictures(const CoarseFlame& flame, const ComputeOptions& compute, int pixels = 20000);

  /// One picture a view. `options` may bring the scattered light and the gas.
  [[nodiscard]] std::vector<RadianceImage> operator()(const Effects& effects,
                                                      RenderOptions options = {}) const;

  /// The flame, cut to its medium.
  [[nodiscard]] const Volume& volume() const { return volume_; }
  [[nodiscard]] const Hull& medium() const { return medium_; }
  [[nodiscard]] int stride() const { return stride_; }

 private:
  ComputeOptions compute_;
  Volume volume_;
  Hull medium_;
  int stride_ = 1;
  std::vector<CameraModel> cameras_;
  std::vector<RadianceImage> backgrounds_;  ///< of size 0 where a view has none
};

/// RMS difference of two sets of pictures after the best gain on the second, all channels; the mean square is
/// taken over each picture, then over them. 0 where the second set is black.
double change(const std::vector<RadianceImage>& with, const std::vector<RadianceImage>& without);

}  // namespace emberlock::recon
