// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include <cuda_runtime.h>

#include "recon/compute/cuda_buffer.h"

namespace emberlock::recon {

/// Launches, copies and clearings on the GPU that are made once and repeated as one.
class CudaGraph {
 public:
  /// Of what `launches` asks of the calling thread's stream, none of which runs yet. It may neither allocate
  /// nor wait.
  template <class Launches>
  explicit CudaGraph(const Launches& launches) {
    check_cuda(cudaStreamBeginCapture(cudaStreamPerThread, cudaStreamCaptureModeThreadLocal),
               "recording launches");
    cudaGraph_t recorded = nullptr;
    try {
      launches();
    } catch (...) {
      if (cudaStreamEndCapture(cudaStreamPerThread, &recorded) == cudaSuccess)
        (void)cudaGraphDestroy(recorded);
      (void)cudaGetLastError();
      throw;
    }
    check_cuda(cudaStreamEndCapture(cudaStreamPerThread, &recorded), "recording launches");
    const cudaError_t code = cudaGraphInstantiate(&graph_, recorded, 0);
    (void)cudaGraphDestroy(recorded);
    check_cuda(code, "making a graph of launches");
  }
  CudaGraph(CudaGraph&& o) noexcept : graph_(std::exchange(o.graph_, nullptr)) {}
  CudaGraph& operator=(CudaGraph&& o) noexcept {
    std::swap(graph_, o.graph_);
    return *this;
  }
  ~CudaGraph() {
    if (graph_ != nullptr) (void)cudaGraphExecDestroy(graph_);
  }

  void launch() const {
    ++counted_work().launches;
    check_cuda(cudaGraphLaunch(graph_, cudaStreamPerThread), "repeating launches");
  }

 private:
  cudaGraphExec_t graph_ = nullptr;
};

}  // namespace emberlock::recon
