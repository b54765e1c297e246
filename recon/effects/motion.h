// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "recon/effects/effects.h"
#include "recon/views/view.h"

namespace emberlock::recon {

// A view that is late sees the flame carried on by velocity * lateness. A camera that is moved back by as
// much sees what is carried as it was at the scene's instant, so no march and no solver knows of the motion.
// What stays, the average, would move with the camera: what it shows from the one place and not from the
// other is taken out of the picture, by the average picture itself.

/// Whether the motion changes anything: it is on, and some view is late.
[[nodiscard]] bool moves(const Scene& scene, const Motion& motion);

/// Whether the views' pictures show the flame of the scene's instant at all: error (refused) where the motion
/// carries a view's flame by more than half of the box's longest edge, as what was in the box then has left
/// it.
Status check_carried(const Scene& scene, const Motion& motion);

/// The camera of a late view, moved back to see the flame of the scene's instant.
CameraModel camera_at_instant(const View& view, const Motion& motion);

/// How `picture` of a view's camera differs from what the moved camera would see of the same, for light from
/// about the distance of `flame` (metres, world).
RadianceImage change_of_place(const RadianceImage& picture, const View& view, const Motion& motion,
                              const Eigen::Vector3d& flame);

/// A view as it would have been filmed at the scene's instant, by the moved camera. Pictures must be linear
/// in light. Pixels from `white` on (> 0) are bounds and stay.
void bring_to_instant(View& view, const Motion& motion, const Eigen::Vector3d& flame, double white = 0);

/// All views of a scene, whose pictures must be linear in light, at its instant. Averages, which belong to
/// the cameras where they stood, are left out.
Scene at_one_instant(Scene scene, const Motion& motion, double white = 0);

}  // namespace emberlock::recon
