// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <mutex>
#include <utility>

#include "recon/compute/gpu_pictures.h"

namespace emberlock::recon {
namespace {

template <class T>
struct Copies {
  struct Copy {
    std::weak_ptr<const std::vector<T>> original;
    std::shared_ptr<const CudaBuffer<T>> on_gpu;
  };
  std::mutex mutex;
  std::map<std::pair<int, const void*>, Copy> of;  // GPU, address of the original
};

}  // namespace

template <class T>
std::shared_ptr<const CudaBuffer<T>> on_gpu(
    const std::shared_ptr<const std::vector<T>>& original,
    const std::function<CudaBuffer<std::type_identity_t<T>>()>& make) {
  if (!original) return nullptr;
  // Never destroyed: at the end of the process the driver may be gone before.
  static auto& copies = *new Copies<T>;
  int gpu = 0;
  check_cuda(cudaGetDevice(&gpu), "asking for the GPU");
  const std::lock_guard lock(copies.mutex);
  const auto forgotten = [&](const auto& c) { return c.first.first == gpu && c.second.original.expired(); };
  if (std::any_of(copies.of.begin(), copies.of.end(), forgotten)) {
    check_cuda(cudaDeviceSynchronize(), "waiting for those who still read a picture");
    std::erase_if(copies.of, forgotten);
  }
  auto& copy = copies.of[{gpu, original.get()}];
  if (!copy.on_gpu) {
    copy = {original, std::make_shared<const CudaBuffer<T>>(make ? make() : CudaBuffer<T>(*original))};
    check_cuda(cudaStreamSynchronize(cudaStreamPerThread),
               "copying a picture for the streams of other threads");
  }
  return copy.on_gpu;
}

template std::shared_ptr<const CudaBuffer<float>> on_gpu(const std::shared_ptr<const std::vector<float>>&,
                                                         const std::function<CudaBuffer<float>()>&);
template std::shared_ptr<const CudaBuffer<std::uint8_t>> on_gpu(
    const std::shared_ptr<const std::vector<std::uint8_t>>&,
    const std::function<CudaBuffer<std::uint8_t>()>&);

}  // namespace emberlock::recon
