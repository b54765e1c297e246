// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/views/radiance_image.h"

namespace emberlock::test {

/// A picture's pixels as the first GPU has them, where there is CUDA.
std::vector<float> pixels_on_gpu(const recon::SharedImage& image);

}  // namespace emberlock::test
