// SPDX-License-Identifier: Apache-2.0
#include "recon/views/picture_on_gpu.h"
#include "tests/support/picture_on_gpu.h"

namespace emberlock::test {

std::vector<float> pixels_on_gpu(const recon::SharedImage& image) { return recon::on_gpu(image)->download(); }

}  // namespace emberlock::test
