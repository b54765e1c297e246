// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "recon/views/view.h"

namespace emberlock::recon {

/// Refuses what no later stage can use, naming the view: no views, an image whose size differs from its
/// camera's, NaN or infinite pixels or cameras, a box without extent.
Status check_scene(const Scene& scene);

}  // namespace emberlock::recon
