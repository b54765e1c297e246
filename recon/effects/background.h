// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/effects/effects.h"
#include "recon/hull/ray_list.h"
#include "recon/preprocess/view.h"

namespace emberlock::recon {

// A background is what a pixel shows where nothing is in front of it. Its distance isn't known, so rays that
// the gas bends see it at their own pixel.

/// An Error, with the view's name, where its own background picture isn't of its image's size.
Status check(const Background& background, const View& view);

/// The background as a camera with pictures of `size` sees it, in linear grey levels; `own` is the view's own
/// picture, for Kind::image, or null.
RadianceImage backdrop(const Background& background, ImageSize size, const RadianceImage* own);

/// The background at the pixel of each ray of a list through `views`, whose pictures must pass `check`; empty
/// where all is black.
std::vector<Rgba> behind_rays(const Background& background, const RayList& list,
                              const std::vector<const View*>& views);

}  // namespace emberlock::recon
