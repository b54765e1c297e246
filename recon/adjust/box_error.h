// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "recon/adjust/engine.h"
#include "recon/views/flame_mask.h"

namespace emberlock::recon {

/// The mean squared error over each view's box, from an engine's residuals of a problem whose first `rays`
/// rays (default: all) are every stride-th pixel of the views along both axes. The engine must outlive it.
class ErrorOverBoxes {
 public:
  ErrorOverBoxes(const std::vector<PixelBox>& boxes, const Problem& problem, ResidualEngine& engine,
                 int stride = 1, std::optional<std::size_t> rays = std::nullopt);
  /// RMSE for R, G, B: the mean square over each view's box, without pixels that are left out, then over the
  /// views, of the engine's residuals as they are now.
  [[nodiscard]] std::array<double, 3> operator()() const;
  /// The same for pictures that show only the background.
  [[nodiscard]] std::array<double, 3> black() const;

 private:
  const ResidualEngine& engine_;
  std::size_t weights_ = 0;  // that the engine keeps, of rays: 1 / (pixels of its box * views), 0 outside
  std::array<double, 3> black_ = {};  // squared
  std::array<double, 3> unreached_ =
      {};  // contribution of pixels that no ray reaches: they show the background
};

}  // namespace emberlock::recon
