#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include <cuda_runtime.h>

namespace emberlock {

/// Throws on a CUDA error: after cuda_status() has answered, one is a failing device or a defect of ours.
inline void check_cuda(cudaError_t code, const char* what) {
  if (code != cudaSuccess) throw std::runtime_error(std::string(what) + ": " + cudaGetErrorString(code));
}

/// Owns an array in the GPU's memory.
template <class T>
class CudaBuffer {
 public:
  explicit CudaBuffer(std::size_t size) : size_(size) {
    check_cuda(cudaMalloc(&data_, (size == 0 ? 1 : size) * sizeof(T)), "cudaMalloc");
    clear();
  }
  explicit CudaBuffer(const std::vector<T>& from) : CudaBuffer(from.size()) { upload(from); }
  CudaBuffer(const CudaBuffer&) = delete;
  CudaBuffer& operator=(const CudaBuffer&) = delete;
  ~CudaBuffer() { cudaFree(data_); }

  [[nodiscard]] T* data() const { return data_; }
  void swap(CudaBuffer& o) { std::swap(data_, o.data_); }
  void clear() { check_cuda(cudaMemset(data_, 0, size_ * sizeof(T)), "cudaMemset"); }
  void upload(const std::vector<T>& from) {
    check_cuda(cudaMemcpy(data_, from.data(), size_ * sizeof(T), cudaMemcpyHostToDevice), "copy to the GPU");
  }
  void copy_from(const CudaBuffer& o) {
    check_cuda(cudaMemcpy(data_, o.data_, size_ * sizeof(T), cudaMemcpyDeviceToDevice), "copy on the GPU");
  }
  [[nodiscard]] std::vector<T> download() const {
    std::vector<T> to(size_);
    check_cuda(cudaMemcpy(to.data(), data_, size_ * sizeof(T), cudaMemcpyDeviceToHost), "copy from the GPU");
    return to;
  }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace emberlock
