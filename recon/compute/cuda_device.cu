// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <map>
#include <mutex>
#include <string>

#include <cuda_runtime.h>

#include "recon/compute/cuda_buffer.h"
#include "recon/compute/cuda_device.h"

namespace emberlock::recon {
namespace {

/// Why a GPU isn't usable; empty if it is.
std::string missing(int gpu) {
  int devices = 0;
  const cudaError_t code = cudaGetDeviceCount(&devices);
  if (code != cudaSuccess) return cudaGetErrorString(code);
  if (devices == 0) return "no GPU was found";
  if (gpu >= devices)
    return "there is no GPU " + std::to_string(gpu) + ", the last is " + std::to_string(devices - 1);
  int major = 0;
  int minor = 0;
  int pools = 0;
  if (cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, gpu) != cudaSuccess ||
      cudaDeviceGetAttribute(&minor, cudaDevAttrComputeCapabilityMinor, gpu) != cudaSuccess ||
      cudaDeviceGetAttribute(&pools, cudaDevAttrMemoryPoolsSupported, gpu) != cudaSuccess)
    return "the GPU doesn't answer";
  constexpr int kOldest = 75;  // the oldest architecture for which the build compiles
  if (10 * major + minor < kOldest)
    return "the GPU has compute capability " + std::to_string(major) + "." + std::to_string(minor) +
           ", less than 7.5";
  if (pools == 0) return "the GPU's driver has no memory pools";
  return {};
}

Status ask_cuda(int gpu) {
  const std::string why = missing(gpu);
  if (why.empty()) return {};
  return Error{
      ErrorKind::device, "CUDA can't run here: " + why, "device " + name(Device(Device::cuda, gpu)),
      "Install an NVIDIA GPU of compute capability 7.5 or later and its driver, or use --device cpu"};
}

cudaMemPool_t pool_of(int gpu) {
  cudaMemPool_t pool = nullptr;
  check_cuda(cudaDeviceGetDefaultMemPool(&pool, gpu), "asking for its memory");
  return pool;
}

/// Of the calling thread's GPU.
std::size_t ask_pool(cudaMemPoolAttr what) {
  int gpu = 0;
  check_cuda(cudaGetDevice(&gpu), "asking for the GPU");
  std::uint64_t bytes = 0;
  check_cuda(cudaMemPoolGetAttribute(pool_of(gpu), what, &bytes), "asking for its memory");
  return bytes;
}

/// Keeps freed memory for the next allocation, instead of returning it to the driver at every wait.
void keep_freed_memory(int gpu) {
  std::uint64_t all = ~std::uint64_t{0};
  check_cuda(cudaMemPoolSetAttribute(pool_of(gpu), cudaMemPoolAttrReleaseThreshold, &all),
             "setting up its memory");
}

}  // namespace

Status cuda_status(int gpu) {
  static std::mutex mutex;
  static std::map<int, Status> asked;
  const std::lock_guard lock(mutex);
  const auto known = asked.find(gpu);
  return known != asked.end() ? known->second : asked.emplace(gpu, ask_cuda(gpu)).first->second;
}

void use_gpu(int gpu) {
  check_cuda(cudaSetDevice(gpu), "choosing the GPU");
  keep_freed_memory(gpu);
}

std::size_t reserved_gpu_memory() { return ask_pool(cudaMemPoolAttrReservedMemCurrent); }

void reserve_gpu_memory(std::size_t bytes) {
  const std::size_t used = ask_pool(cudaMemPoolAttrUsedMemCurrent);
  const std::size_t wanted = bytes - std::min(bytes, used);
  if (reserved_gpu_memory() - used >= wanted) return;
  std::size_t free = 0;
  std::size_t total = 0;
  check_cuda(cudaMemGetInfo(&free, &total), "asking for its memory");
  // What others want of the GPU is not known: half of what is free is theirs. One that is refused costs
  // nothing but time: the pool then grows piece by piece.
  void* data = nullptr;
  if (cudaMallocAsync(&data, std::min(wanted, free / 2), nullptr) == cudaSuccess)
    cuda_free(data);
  else
    (void)cudaGetLastError();
}

void finish_gpu_work() { check_cuda(cudaStreamSynchronize(cudaStreamPerThread), "waiting for its work"); }

void check_cuda(cudaError_t code, const char* what) {
  if (code == cudaSuccess) return;
  throw DeviceError(
      {ErrorKind::device, std::string("the GPU failed at ") + what + ": " + cudaGetErrorString(code),
       "device cuda", "Use --device cpu, and look at the driver's log (dmesg) for the GPU's state"});
}

CountedWork& counted_work() {
  static CountedWork counted;
  return counted;
}

GpuWork gpu_work() {
  const CountedWork& c = counted_work();
  return {c.launches, c.uploads, c.uploaded, c.downloads, c.downloaded};
}

void cuda_copy(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind) {
  CountedWork& counted = counted_work();
  if (kind == cudaMemcpyHostToDevice) {
    ++counted.uploads;
    counted.uploaded += bytes;
  } else if (kind == cudaMemcpyDeviceToHost) {
    ++counted.downloads;
    counted.downloaded += bytes;
  }
  check_cuda(cudaMemcpy(to, from, bytes, kind), "copying memory");
}

void* cuda_allocate(std::size_t bytes) {
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
