#include <string>

#include <cuda_runtime.h>

#include "recon/compute/cuda_device.h"

namespace emberlock {

Status cuda_status() {
  int devices = 0;
  const cudaError_t code = cudaGetDeviceCount(&devices);
  if (code == cudaSuccess && devices > 0) return {};
  const std::string why = code == cudaSuccess ? "no GPU was found" : cudaGetErrorString(code);
  return Error{ErrorKind::device, "CUDA can't run here: " + why, "device cuda",
               "Install an NVIDIA GPU and its driver, or use --device cpu"};
}

}  // namespace emberlock
