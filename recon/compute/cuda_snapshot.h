// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

#include "recon/compute/cuda_buffer.h"

namespace emberlock::recon {

/// Copies an array from the GPU to the CPU without stopping the default stream. The default stream only makes
/// a copy on the GPU; another stream transfers it to one of two page-locked buffers, while the other buffer
/// holds the last complete transfer.
template <class T>
class CudaSnapshot {
 public:
  explicit CudaSnapshot(std::size_t size) : staging_(CudaBuffer<T>::unfilled(size)) {
    try {
      check_cuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "making a stream");
      check_cuda(cudaEventCreateWithFlags(&ready_, cudaEventDisableTiming), "making an event");
      check_cuda(cudaEventCreateWithFlags(&arrived_, cudaEventDisableTiming), "making an event");
      for (T*& host : host_) check_cuda(cudaMallocHost(&host, staging_.bytes()), "locking memory of the CPU");
    } catch (...) {
      release();
      throw;
    }
  }
  CudaSnapshot(CudaSnapshot&&) = delete;
  CudaSnapshot& operator=(CudaSnapshot&&) = delete;
  ~CudaSnapshot() { release(); }

  /// Starts a transfer of the content that the default stream leaves in `from` (of the same size), unless one
  /// is under way.
  void start(const CudaBuffer<T>& from) {
    if (under_way_) return;
    staging_.copy_from(from);
    check_cuda(cudaEventRecord(ready_, nullptr), "marking a copy");
    check_cuda(cudaStreamWaitEvent(stream_, ready_), "waiting for a copy");
    check_cuda(cudaMemcpyAsync(host_[1 - front_], staging_.data(), staging_.bytes(), cudaMemcpyDeviceToHost,
                               stream_),
               "copying from the GPU");
    check_cuda(cudaEventRecord(arrived_, stream_), "marking a copy");
    under_way_ = true;
  }

  /// The last complete transfer; null before the first. Valid until the next call.
  [[nodiscard]] const T* latest() {
    if (under_way_) {
      const cudaError_t code = cudaEventQuery(arrived_);
      if (code != cudaErrorNotReady) {
        check_cuda(code, "copying from the GPU");
        under_way_ = false;
        any_ = true;
        front_ = 1 - front_;
      }
    }
    return any_ ? host_[front_] : nullptr;
  }

 private:
  void release() noexcept {
    if (stream_ != nullptr) (void)cudaStreamSynchronize(stream_);
    for (T* host : host_)
      if (host != nullptr) (void)cudaFreeHost(host);
    if (arrived_ != nullptr) (void)cudaEventDestroy(arrived_);
    if (ready_ != nullptr) (void)cudaEventDestroy(ready_);
    if (stream_ != nullptr) (void)cudaStreamDestroy(stream_);
  }

  CudaBuffer<T> staging_;
  T* host_[2] = {nullptr, nullptr};
  cudaStream_t stream_ = nullptr;
  cudaEvent_t ready_ = nullptr;
  cudaEvent_t arrived_ = nullptr;
  int front_ = 0;
  bool under_way_ = false;
  bool any_ = false;
};

}  // namespace emberlock::recon
