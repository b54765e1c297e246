// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/compute/pool.h"
#include "recon/effects/effects.h"
#include "recon/kernels/grid.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

/// B: what a shutter makes of a flame that rises while it is open. The volume is the flame at the middle of
/// the exposure; B x is the mean of x shifted along z by many equally spaced parts of the way, linear between
/// key points, spread so that their mean square is the motion's own. Pictures of B x are the mean of the
/// pictures at all instants where nothing absorbs; where the medium absorbs they leave out that it moves too
/// (exposure_test.cpp measures both). Light that B carries out of the grid or the medium isn't seen: the hull
/// of pictures with this exposure holds it. Motion of at most half a voxel edge is left out.
class ExposureBlur {
 public:
  /// `exposure` must pass `check`.
  ExposureBlur(const Exposure& exposure, const Grid& grid);

  /// B x = x.
  [[nodiscard]] bool identity() const { return weights_.size() == 1; }
  /// Of x shifted by m = -reach..reach edges: 2 * reach + 1, none negative; they sum to 1.
  [[nodiscard]] const std::vector<float>& weights() const { return weights_; }

  /// B x and its transpose B^T y, at the grid's key points, all four lanes. The same bits for any number of
  /// threads.
  [[nodiscard]] std::vector<Rgba> forward(const std::vector<Rgba>& x, Pool& pool) const;
  [[nodiscard]] std::vector<Rgba> adjoint(const std::vector<Rgba>& y, Pool& pool) const;

 private:
  [[nodiscard]] std::vector<Rgba> average(const std::vector<Rgba>& in, int direction, Pool& pool) const;

  Grid grid_;
  std::vector<float> weights_;
};

}  // namespace emberlock::recon
