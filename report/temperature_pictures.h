// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/image.h"
#include "recon/pipeline/reconstruct.h"
#include "report/volume_axes.h"

namespace emberlock::report {

/// A plane through the middle of what is told, across axis `along` of the world, `low` to `high` from dark to
/// bright; grey where no temperature is told.
Image temperature_slice(const recon::Grid& grid, const std::vector<float>& kelvin, const ShownAxes& axes,
                        int along, double low, double high);

/// A heading, sentences, slices of temperature and of its error, each with a colour bar in K.
std::string temperature_html(const recon::Outcome& outcome, const ShownAxes& axes);

}  // namespace emberlock::report
