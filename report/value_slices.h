// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/image.h"
#include "recon/kernels/grid.h"
#include "report/volume_axes.h"

namespace emberlock::report {

/// What is drawn of a grid's values: from dark to bright.
struct ValueRange {
  double low = 0, high = 1;
  std::string unit = {};
};

/// A plane through the middle of what is told (above 0), across axis `along` of the world; grey where nothing
/// is told.
Image value_slice(const recon::Grid& grid, const std::vector<float>& values, const ShownAxes& axes, int along,
                  const ValueRange& range);

/// Slices across each axis, called `what`, and below them a colour bar.
std::string value_slices_html(const recon::Grid& grid, const std::vector<float>& values,
                              const ShownAxes& axes, const ValueRange& range, const std::string& what);

}  // namespace emberlock::report
