// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <type_traits>
#include <vector>

#include "recon/compute/cuda_buffer.h"

namespace emberlock::recon {

/// What is shared between views and never changes, in the memory of the calling thread's GPU: copied when it
/// is first asked for, or made there by `make`, and freed when nobody holds the original any longer and
/// another is asked for. Null for null.
template <class T>
std::shared_ptr<const CudaBuffer<T>> on_gpu(
    const std::shared_ptr<const std::vector<T>>& original,
    const std::function<CudaBuffer<std::type_identity_t<T>>()>& make = {});
extern template std::shared_ptr<const CudaBuffer<float>> on_gpu(
    const std::shared_ptr<const std::vector<float>>&, const std::function<CudaBuffer<float>()>&);
extern template std::shared_ptr<const CudaBuffer<std::uint8_t>> on_gpu(
    const std::shared_ptr<const std::vector<std::uint8_t>>&,
    const std::function<CudaBuffer<std::uint8_t>()>&);

}  // namespace emberlock::recon
