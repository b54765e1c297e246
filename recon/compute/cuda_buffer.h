// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <cuda_runtime.h>

#include "recon/compute/device.h"

namespace emberlock::recon {

/// Throws a DeviceError. As cuda_status() succeeded before, this means a failing device or a bug.
void check_cuda(cudaError_t code, const char* what);

/// Allocates memory on the GPU in the order of the default stream's launches and copies, so that nothing has
/// to wait; the DeviceError says how much was requested and how much is free. Freed memory stays with the
/// process for reuse.
void* cuda_allocate(std::size_t bytes);
void cuda_free(void* data) noexcept;

/// For gpu_work().
struct CountedWork {
  std::atomic<std::uint64_t> launches = 0, uploads = 0, uploaded = 0, downloads = 0, downloaded = 0;
};
CountedWork& counted_work();

/// Copies from and to the CPU's memory wait until they are complete.
void cuda_copy(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind);

/// Owns an array in the GPU's memory. Its launches and copies run in the order of the default stream.
template <class T>
class CudaBuffer {
 public:
  CudaBuffer() = default;
  /// Filled with zero bytes.
  explicit CudaBuffer(std::size_t size) : CudaBuffer(size, Unfilled{}) { clear(); }
  explicit CudaBuffer(const std::vector<T>& from) : CudaBuffer(from.data(), from.size()) {}
  CudaBuffer(const T* from, std::size_t size) : CudaBuffer(size, Unfilled{}) {
    copy(data_, from, cudaMemcpyHostToDevice);
  }
  CudaBuffer(CudaBuffer&& o) noexcept { swap(o); }
  CudaBuffer& operator=(CudaBuffer&& o) noexcept {
    swap(o);
    return *this;
  }
  ~CudaBuffer() { cuda_free(data_); }

  /// With undefined content, for kernels that write it before it is read.
  static CudaBuffer unfilled(std::size_t size) { return CudaBuffer(size, Unfilled{}); }

  [[nodiscard]] T* data() const { return data_; }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t bytes() const { return size_ * sizeof(T); }
  void swap(CudaBuffer& o) noexcept {
    std::swap(data_, o.data_);
    std::swap(size_, o.size_);
  }
  void clear() {
    if (size_ > 0) check_cuda(cudaMemsetAsync(data_, 0, bytes()), "clearing memory of the GPU");
  }
  /// Takes the size of `from`.
  void upload(const std::vector<T>& from) {
    if (from.size() != size_) *this = CudaBuffer(from.size(), Unfilled{});
    copy(data_, from.data(), cudaMemcpyHostToDevice);
  }
  /// Sizes must be equal.
  void copy_from(const CudaBuffer& o) { copy(data_, o.data_, cudaMemcpyDeviceToDevice); }
  void download(T* to) const { copy(to, data_, cudaMemcpyDeviceToHost); }
  [[nodiscard]] T download_one(std::size_t at) const {
    T to;
    cuda_copy(&to, data_ + at, sizeof(T), cudaMemcpyDeviceToHost);
    return to;
  }
  [[nodiscard]] std::vector<T> download() const {
    std::vector<T> to(size_);
    download(to.data());
    return to;
  }

 private:
  struct Unfilled {};
  CudaBuffer(std::size_t size, Unfilled) : size_(size) {
    if (size > 0) data_ = static_cast<T*>(cuda_allocate(bytes()));
  }

  void copy(T* to, const T* from, cudaMemcpyKind kind) const {
    if (size_ > 0) cuda_copy(to, from, bytes(), kind);
  }

  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace emberlock::recon
