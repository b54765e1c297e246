// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <Eigen/Core>

#include "report/volume_axes.h"
#include "report/volume_pictures.h"

namespace emberlock::report {

/// The volume to turn with mouse, touch or keyboard: a script of its own that marches rays with WebGL2, with
/// the volume's values in the page. Where there is no WebGL2 it says so. `from` is the direction, in the
/// world, from which the volume is seen first.
std::string volume_view_html(const SmallVolume& volume, const ShownAxes& axes, const Eigen::Vector3d& from);

}  // namespace emberlock::report
