// SPDX-License-Identifier: Apache-2.0
#include "recon/compute/device.h"

#include <cstdlib>
#include <string>

#include "recon/compute/cuda_device.h"

namespace emberlock::recon {

Result<Precision> parse_precision(std::string_view name) {
  if (name == "float32") return Precision::float32;
  if (name == "float64") return Precision::float64;
  return Error{ErrorKind::bad_input, "unknown precision '" + std::string(name) + "'", "precision",
               "Use float32 or float64"};
}

std::string_view name(Precision precision) { return precision == Precision::float32 ? "float32" : "float64"; }

Result<Device> parse_device(std::string_view name) {
  if (name == "auto") return Device::automatic;
  if (name == "cpu") return Device::cpu;
  if (name == "cuda") return Device::cuda;
  return Error{ErrorKind::bad_input, "unknown device '" + std::string(name) + "'", "device",
               "Use auto, cpu or cuda"};
}

Result<Device> resolve(Device choice) {
  const char* named = choice == Device::automatic ? std::getenv("EMBERLOCK_DEVICE") : nullptr;
  if (named != nullptr) {
    EMBERLOCK_ASSIGN_OR_RETURN(choice, parse_device(named));
  }
  if (choice == Device::cpu) return Device::cpu;
  const Status cuda = cuda_status();
  if (cuda.ok()) return Device::cuda;
  if (choice == Device::automatic) return Device::cpu;
  return cuda.error();
}

#ifndef EMBERLOCK_HAVE_CUDA
Status cuda_status() {
  return Error{ErrorKind::device, "this build has no CUDA backend", "device cuda",
               "Build where nvcc is on PATH, or use --device cpu"};
}
#endif

}  // namespace emberlock::recon
