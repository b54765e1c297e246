// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/compute/pool.h"
#include "recon/effects/effects.h"
#include "recon/kernels/grid.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

/// The operator B: the effect of a finite exposure on a rising flame. The volume is the flame at the middle
/// of the exposure. B x is the mean of x shifted along z in many equal parts of the distance, linear between
/// key points, spread so that the mean square shift equals that of the motion. If nothing absorbs, pictures
/// of B x are the mean of the pictures at all instants; if the medium absorbs, its own motion is neglected
/// (exposure_test.cpp measures both). Light that B moves out of the grid or the medium is lost, so the hull
/// must come from pictures with this exposure. Motion of at most half a voxel edge is neglected.
class ExposureBlur {
 public:
  /// `exposure` must pass `check`.
  ExposureBlur(const Exposure& exposure, const Grid& grid);

  /// B x = x.
  [[nodiscard]] bool identity() const { return weights_.size() == 1; }
  /// Weights of x shifted by m = -reach..reach edges: 2 * reach + 1 values, none negative, with sum 1.
  [[nodiscard]] const std::vector<float>& weights() const { return weights_; }

  /// B x and its transpose B^T y at the grid's key points, for all four lanes. Bit-identical for any number
  /// of threads.
  [[nodiscard]] std::vector<Rgba> forward(const std::vector<Rgba>& x, Pool& pool) const;
  [[nodiscard]] std::vector<Rgba> adjoint(const std::vector<Rgba>& y, Pool& pool) const;

 private:
  [[nodiscard]] std::vector<Rgba> average(const std::vector<Rgba>& in, int direction, Pool& pool) const;

  Grid grid_;
  std::vector<float> weights_;
};

}  // namespace emberlock::recon
