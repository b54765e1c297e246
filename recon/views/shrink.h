// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/views/view.h"

namespace emberlock::recon {

/// A view with pictures of a `factor`-th of their size, the means of factor^2 pixels; rows and columns that
/// are left over at the right and below are cut off. A mean is a bound as soon as one of its pixels is.
/// `factor` is at most the picture's shorter side.
View shrunk(const View& view, int factor);

}  // namespace emberlock::recon
