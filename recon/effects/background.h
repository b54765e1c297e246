// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/effects/effects.h"
#include "recon/views/view.h"

namespace emberlock::recon {

// A background is what a pixel shows with nothing in front of it. Its distance isn't known, so bent rays see
// it at their own pixel.

/// The Error names the view if its own background picture has another size than its image.
Status check(const Background& background, const View& view);

/// The background for a camera with pictures of `size`, in linear grey levels. `own` is the view's own
/// picture for Kind::image, or null.
RadianceImage backdrop(const Background& background, ImageSize size, const RadianceImage* own);

}  // namespace emberlock::recon
