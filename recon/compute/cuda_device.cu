// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <cstdio>
#include <string>

#include <cuda_runtime.h>

#include "recon/compute/cuda_buffer.h"
#include "recon/compute/cuda_device.h"

namespace emberlock::recon {
namespace {

/// Why the first GPU isn't usable; empty if it is.
std::string missing() {
  int devices = 0;
  const cudaError_t code = cudaGetDeviceCount(&devices);
  if (code != cudaSuccess) return cudaGetErrorString(code);
  if (devices == 0) return "no GPU was found";
  int major = 0;
  int minor = 0;
  int pools = 0;
  if (cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, 0) != cudaSuccess ||
      cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, 0) != cudaSuccess ||
      cudaDeviceGetAttribute(&pools, cudaDevAttrMemoryPoolsSupported, 0) != cudaSuccess)
    return "the GPU doesn't answer";
  constexpr int kOldest = 75;  // the oldest architecture for which the build compiles
  if (10 * major + minor < kOldest)
    return "the GPU has compute capability " + std::to_string(major) + "." + std::to_string(minor) +
           ", less than 7.5";
  if (pools == 0) return "the GPU's driver has no memory pools";
  return {};
}

Status ask_cuda() {
  const std::string why = missing();
  if (why.empty()) return {};
  return Error{
      ErrorKind::device, "CUDA can't run here: " + why, "device cuda",
      "Install an NVIDIA GPU of compute capability 7.5 or later and its driver, or use --device cpu"};
}

/// Keeps freed memory for the next allocation, instead of returning it to the driver at every wait.
void keep_freed_memory() {
  int device = 0;
  cudaMemPool_t pool = nullptr;
  check_cuda(cudaGetDevice(&device), "asking for the device");
  check_cuda(cudaDeviceGetDefaultMemPool(&pool, device), "asking for its memory");
  std::uint64_t all = ~std::uint64_t{0};
  check_cuda(cudaMemPoolSetAttribute(pool, cudaMemPoolAttrReleaseThreshold, &all), "setting up its memory");
}

}  // namespace

Status cuda_status() {
  static const Status status = ask_cuda();
  return status;
}

void check_cuda(cudaError_t code, const char* what) {
  if (code == cudaSuccess) return;
  throw DeviceError(
      {ErrorKind::device, std::string("the GPU failed at ") + what + ": " + cudaGetErrorString(code),
       "device cuda", "Use --device cpu, and look at the driver's log (dmesg) for the GPU's state"});
}

void* cuda_allocate(std::size_t bytes) {
  static const bool kept = (keep_freed_memory(), true);
  (void)kept;
  void* data = nullptr;
  const cudaError_t code = cudaMallocAsync(&data, bytes, nullptr);
  if (code != cudaErrorMemoryAllocation) {
    check_cuda(code, "allocating memory");
    return data;
  }
  (void)cudaGetLastError();  // clears this error, which is reported here
  std::size_t free = 0;
  std::size_t total = 0;
  check_cuda(cudaMemGetInfo(&free, &total), "asking for its memory");
  constexpr double kMega = 1e6;
  char words[128];
  std::snprintf(words, sizeof words,
                "the GPU's memory is too small: %.1f MB more are needed, %.1f of %.1f MB are free",
                static_cast<double>(bytes) / kMega, static_cast<double>(free) / kMega,
                static_cast<double>(total) / kMega);
  throw DeviceError(
      {ErrorKind::device, words, "device cuda",
       "Give fewer voxels or a smaller box, end other programs on the GPU, or use --device cpu"});
}

void cuda_free(void* data) noexcept {
  if (data != nullptr) (void)cudaFreeAsync(data, nullptr);  // a failure is reported by a later call
}

}  // namespace emberlock::recon
