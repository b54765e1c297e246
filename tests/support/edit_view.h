// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "recon/views/view.h"

namespace emberlock {

/// Views share pictures that nobody changes: gives this one a changed copy of its own.
template <class Change>
void edit(recon::SharedImage& image, const Change& change) {
  recon::RadianceImage own = *image;
  change(own);
  image = recon::share(std::move(own));
}

}  // namespace emberlock
