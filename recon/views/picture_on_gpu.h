// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "recon/compute/cuda_buffer.h"
#include "recon/views/radiance_image.h"

namespace emberlock::recon {

/// A picture's pixels in the memory of the calling thread's GPU, kept there as on_gpu() of gpu_pictures.h
/// keeps them. One that knows its origin is developed there, bit by bit as on the CPU: the sensor's samples
/// are copied, of a mosaic of 8 bits one byte a pixel instead of twelve. Null for null. Throws a DeviceError.
std::shared_ptr<const CudaBuffer<float>> on_gpu(const SharedImage& image);

}  // namespace emberlock::recon
